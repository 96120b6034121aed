"""Tests remote driving by the web UI: scaled velocities, rate limit, stop on disconnection, and error messages."""

from __future__ import annotations

import time

import pytest
from tests.support.fake_robot import FakeRobot, fake_robot
from tests.support.waiting import PATIENCE

from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.ui.commands import Drive
from chefbot.ui.remote.web_ui_client import WebUiClient

SECOND = 1_000_000_000
TICK = SECOND // 10


class RemoteDriver:
    """A loop with a remote-drive device for the robot at `url`."""

    def __init__(self, url: str) -> None:
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, load_robot("chefbot"), 1)
        self.notices: list[str] = []
        self.loop.subscribe("remote_drive/notice", "test", self._on_notice)
        entry = NodeEntry(kind="chefbot.ui.remote.remote_drive:RemoteDriveDevice", params={"page": url})
        self.system.launch(Launch(name="t", description="", args={}, nodes={"drive": entry}))

    def _on_notice(self, message: object) -> None:
        assert isinstance(message, String)
        self.notices.append(message.data)

    def publish_velocity(self, v: float, w: float, after_ns: int = TICK) -> None:
        at = self.loop.now_ns + after_ns
        self.loop.schedule(at, 0, lambda: self.loop.publish("cmd_vel_teleop", Twist.of(v, w), "joystick"))
        self.loop.run(until_ns=at)

    def run_until_notice(self) -> None:
        """Run the loop until the thread of the connection has published a notice."""
        for _ in range(2000):
            self.loop.run()
            if self.notices:
                return
            time.sleep(0.01)
        raise AssertionError("no notice was published")


def next_drive(robot: FakeRobot) -> Drive:
    command = robot.commands.get(timeout=PATIENCE)
    assert isinstance(command, Drive)
    return command


def test_twists_arrive_as_fractions_of_the_limits() -> None:
    with fake_robot() as robot:
        driver = RemoteDriver(robot.url)
        limits = Limits.of(driver.system.robot)
        driver.publish_velocity(limits.speed / 2, -limits.angular_speed)
        assert next_drive(robot) == Drive(0.5, -1.0)
        driver.publish_velocity(9.0, -9.0)
        assert next_drive(robot) == Drive(1.0, -1.0)
        driver.publish_velocity(0.0, 0.0)
        assert next_drive(robot) == Drive(0.0, 0.0)
        driver.system.stop()


def test_twists_are_rate_limited_but_a_stop_never() -> None:
    with fake_robot() as robot:
        driver = RemoteDriver(robot.url)
        for _ in range(50):
            driver.publish_velocity(0.1, 0.0, SECOND // 100)
        driver.publish_velocity(0.0, 0.0, 1)
        count = 1
        while not next_drive(robot).is_zero:
            count += 1
        assert 8 <= count <= 12
        driver.system.stop()


@pytest.mark.slow
def test_a_rejected_driver_gets_the_reason() -> None:
    with fake_robot() as robot, WebUiClient(robot.url) as other:
        driver = RemoteDriver(robot.url)
        for _ in range(500):  # until commands of both arrive within the web UI's timeout
            other.send(Drive(1.0, 0.0))
            driver.publish_velocity(0.1, 0.0)
            driver.loop.run()
            if driver.notices:
                break
            time.sleep(0.04)
        driver.run_until_notice()
        assert "in another browser" in driver.notices[0]
        for _ in range(10):
            driver.publish_velocity(0.1, 0.0)
            other.send(Drive(1.0, 0.0))
            time.sleep(0.04)
        assert len(driver.notices) == 1, "the same notice is published once"
        driver.system.stop()


def test_disconnecting_stops_the_robot() -> None:
    with fake_robot() as robot:
        driver = RemoteDriver(robot.url)
        driver.publish_velocity(0.1, 0.1)
        assert not next_drive(robot).is_zero
        driver.system.stop()
        assert next_drive(robot).is_zero


def test_a_robot_shutdown_ends_remote_driving() -> None:
    with fake_robot() as robot:
        driver = RemoteDriver(robot.url)
        robot.server.stop()
        with pytest.raises(UserError, match="has ended"):
            for _ in range(2000):
                driver.loop.run()
                time.sleep(0.01)
        driver.system.stop()


def test_remote_driving_needs_a_robot() -> None:
    with pytest.raises(UserError, match="no robot runs at"):
        RemoteDriver("http://127.0.0.1:1")
