"""Driving a robot by its page: shares of its limits, not too many, and a sentence when it does not work."""

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
from chefbot.ui.web_ui_client import WebUiClient

SECOND = 1_000_000_000
TICK = SECOND // 10


class Driver:
    """A loop whose only device drives the robot at `url`."""

    def __init__(self, url: str) -> None:
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, load_robot("chefbot"), 1)
        self.remarks: list[str] = []
        self.loop.subscribe("remote_drive/remark", "test", self._hear)
        entry = NodeEntry(kind="chefbot.ui.remote_drive:RemoteDriveDevice", params={"page": url})
        self.system.launch(Launch(name="t", description="", args={}, nodes={"drive": entry}))

    def _hear(self, message: object) -> None:
        assert isinstance(message, String)
        self.remarks.append(message.data)

    def say(self, v: float, w: float, after_ns: int = TICK) -> None:
        at = self.loop.now_ns + after_ns
        self.loop.schedule(at, 0, lambda: self.loop.publish("cmd_vel_teleop", Twist.of(v, w), "hand"))
        self.loop.run(until_ns=at)

    def run_until_remark(self) -> None:
        """The remark comes from the connection's thread."""
        for _ in range(2000):
            self.loop.run()
            if self.remarks:
                return
            time.sleep(0.01)
        raise AssertionError("no remark came")


def heard(robot: FakeRobot) -> Drive:
    command = robot.heard.get(timeout=PATIENCE)
    assert isinstance(command, Drive)
    return command


def test_twists_arrive_as_fractions_of_the_limits() -> None:
    with fake_robot() as robot:
        driver = Driver(robot.url)
        limits = Limits.of(driver.system.robot)
        driver.say(limits.speed / 2, -limits.angular_speed)
        assert heard(robot) == Drive(0.5, -1.0)
        driver.say(9.0, -9.0)
        assert heard(robot) == Drive(1.0, -1.0)
        driver.say(0.0, 0.0)
        assert heard(robot) == Drive(0.0, 0.0)
        driver.system.stop()


def test_twists_are_rate_limited_but_a_stop_never() -> None:
    with fake_robot() as robot:
        driver = Driver(robot.url)
        for _ in range(50):
            driver.say(0.1, 0.0, SECOND // 100)
        driver.say(0.0, 0.0, 1)
        count = 1
        while not heard(robot).is_zero:
            count += 1
        assert 8 <= count <= 12
        driver.system.stop()


def test_a_refused_driver_gets_the_reason() -> None:
    with fake_robot() as robot, WebUiClient(robot.url) as other:
        driver = Driver(robot.url)
        for _ in range(500):  # until our word and theirs meet within the page's patience
            other.send(Drive(1.0, 0.0))
            driver.say(0.1, 0.0)
            driver.loop.run()
            if driver.remarks:
                break
            time.sleep(0.04)
        driver.run_until_remark()
        assert "in another browser" in driver.remarks[0]
        for _ in range(10):
            driver.say(0.1, 0.0)
            other.send(Drive(1.0, 0.0))
            time.sleep(0.04)
        assert len(driver.remarks) == 1, "the same is not told again and again"
        driver.system.stop()


def test_disconnecting_stops_the_robot() -> None:
    with fake_robot() as robot:
        driver = Driver(robot.url)
        driver.say(0.1, 0.1)
        assert not heard(robot).is_zero
        driver.system.stop()
        assert heard(robot).is_zero


def test_a_robot_shutdown_ends_remote_driving() -> None:
    with fake_robot() as robot:
        driver = Driver(robot.url)
        robot.server.stop()
        with pytest.raises(UserError, match="has ended"):
            for _ in range(2000):
                driver.loop.run()
                time.sleep(0.01)
        driver.system.stop()


def test_remote_driving_needs_a_robot() -> None:
    with pytest.raises(UserError, match="no robot runs at"):
        Driver("http://127.0.0.1:1")
