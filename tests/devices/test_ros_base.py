"""A base with ROS 2: it is driven by twists, and its odometry becomes ticks."""

from __future__ import annotations

import math

import msgspec
import pytest

from chefbot.board.drives.drive_link import MAX_UNATTENDED_SPEED
from chefbot.errors import ChefbotError
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import BatteryState, Imu
from chefbot.msgs.std_msgs import Bool, Header
from chefbot.robot.errors import RobotFileError
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

NODES = {
    "board": NodeEntry(kind="chefbot.devices.motor_board:MotorBoardDevice"),
    "ros_base": NodeEntry(kind="chefbot.devices.ros_base:RosBaseDevice"),
}


def robot_with(timeout: float | None = 0.2, protocol: str = "ros2") -> Robot:
    robot = load_robot("chefbot")
    drive = msgspec.structs.replace(robot.drive, protocol=protocol, command_timeout=timeout)
    return msgspec.structs.replace(robot, drive=drive)


class Base:
    """A base on the wire that obeys each twist at once and publishes its odometry 50 times a second."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.loop = Loop(StepClock(), 1_000_000_000)
        self.system = NodeContainer(self.loop, robot, 1)
        self.received: dict[str, list[Message]] = {}
        self.loop.add_observer(lambda one: self.received.setdefault(one.topic, []).append(one.message))
        self.system.launch(Launch(name="base", description="", args={}, nodes=NODES))
        self.pose, self.twist = SE2(0.0, 0.0, 0.0), (0.0, 0.0)
        self.clock_error_ns, self.answers = 0, True

    def run(self, seconds: float, command: tuple[float, float] | None = (0.0, 0.0)) -> None:
        """Command the angular velocities of the wheels, rad/s, 50 times a second; None: nobody commands."""
        for _ in range(round(seconds * 50)):
            if command is not None:
                self.loop.publish(
                    "wheel_speeds", WheelSpeeds(Header.of(self.loop.now_ns, ""), *command), "drive"
                )
            self.loop.run(until_ns=self.loop.now_ns + 20_000_000)
            newest = self.messages("base/cmd_vel")[-1] if self.messages("base/cmd_vel") else Twist()
            v, w = newest.linear.x, newest.angular.z
            self.twist = (v, w)
            self.pose = self.pose @ SE2(
                0.02 * v * math.cos(0.01 * w), 0.02 * v * math.sin(0.01 * w), 0.02 * w
            )
            if self.answers:
                header = Header.of(self.loop.now_ns + self.clock_error_ns, "odom")
                message = Odometry(header, "base_link", PoseWithCovariance(Pose.of(self.pose)))
                self.loop.publish("base/odom/unfiltered", message, "micro_ros")

    def messages(self, topic: str) -> list[Message]:
        return self.received.get(topic, [])

    def health(self) -> tuple[int, str]:
        (status,) = self.messages("diagnostics")[-1].status
        return status.level, status.message


def test_it_is_driven_and_its_path_becomes_ticks() -> None:
    base = Base(robot_with())
    base.run(1.0)
    assert base.messages("board_connected")[-1].data is True
    base.run(3.0, (4.0, 6.0))
    ticks = base.messages("wheel_ticks")[-1]
    per_radian = base.robot.motor.ticks_per_turn / (2 * math.pi)
    assert ticks.left / per_radian == pytest.approx(12.0, rel=0.05)
    assert ticks.right / ticks.left == pytest.approx(1.5, rel=0.01)
    assert base.health() == (OK, "The ROS 2 base is OK.")
    base.system.stop()


def test_without_a_command_it_is_sent_zeros() -> None:
    base = Base(robot_with())
    base.run(0.5)
    base.run(0.5, (4.0, 4.0))
    assert base.twist[0] > 0.1
    base.run(0.2, None)
    assert base.twist == (0.0, 0.0)
    count = len(base.messages("base/cmd_vel"))
    base.run(1.0, None)
    assert len(base.messages("base/cmd_vel")) >= count + 19, "a base with a timeout may stand"
    base.system.stop()


def test_the_emergency_stop_holds_until_a_stop_was_commanded() -> None:
    base = Base(robot_with())
    base.run(0.5)
    base.run(0.5, (4.0, 4.0))
    base.loop.publish("emergency_stop", Bool(True), "stop")
    base.run(0.1, (4.0, 4.0))
    assert base.twist == (0.0, 0.0)
    base.loop.publish("emergency_stop", Bool(False), "stop")
    base.run(0.3, (4.0, 4.0))
    assert base.twist == (0.0, 0.0), "the old command does not start it"
    base.run(0.1)
    base.run(0.2, (4.0, 4.0))
    assert base.twist[0] > 0.1
    base.system.stop()


def test_a_silent_base_is_stopped_and_reported() -> None:
    base = Base(robot_with())
    base.run(0.5)
    base.run(0.5, (4.0, 4.0))
    base.answers = False
    base.run(2.0, (4.0, 4.0))
    assert base.twist == (0.0, 0.0) and base.messages("board_connected")[-1].data is False
    level, text = base.health()
    assert level == ERROR and text.startswith("No odometry on base/odom/unfiltered")
    assert base.messages("board/notice")[-1].data.endswith("sends no odometry; the robot stands.")
    base.answers = True
    base.run(0.5, (4.0, 4.0))
    assert base.twist == (0.0, 0.0) and base.messages("board_connected")[-1].data is True
    base.run(0.1)
    base.run(0.2, (4.0, 4.0))
    assert base.twist[0] > 0.1
    base.system.stop()


def test_a_base_without_a_timeout_is_slow() -> None:
    base = Base(robot_with(timeout=None))
    base.run(0.5)
    base.run(0.5, (9.0, 9.0))
    assert base.twist[0] == pytest.approx(MAX_UNATTENDED_SPEED, rel=1e-6)
    base.system.stop()


def test_a_wrong_clock_is_reported_and_not_believed() -> None:
    base = Base(robot_with())
    base.clock_error_ns = -(10**9)
    base.run(1.5)
    assert abs(base.messages("wheel_ticks")[-1].header.stamp.ns - base.loop.now_ns) < 50_000_000
    level, text = base.health()
    assert level == WARN and "clock" in text
    base.system.stop()


def test_imu_and_battery_are_passed_on() -> None:
    base = Base(robot_with())
    base.run(0.1)
    base.loop.publish("base/imu/data", Imu(Header.of(base.loop.now_ns, "imu_link_of_the_board")), "micro_ros")
    base.loop.publish(
        "base/battery", BatteryState(Header.of(base.loop.now_ns, ""), voltage=12.3), "micro_ros"
    )
    base.run(0.1)
    assert base.messages("imu/data")[-1].header.frame_id == "imu_link"
    assert base.messages("battery_state")[-1].voltage == pytest.approx(12.3)
    base.system.stop()


def test_a_robot_with_a_motor_board_has_no_ros_base() -> None:
    robot = load_robot("chefbot")
    loop = Loop(StepClock(), 1_000_000_000)
    system = NodeContainer(loop, robot, 1)
    topics: set[str] = set()
    loop.add_observer(lambda one: topics.add(one.topic))
    system.launch(Launch(name="base", description="", args={}, nodes={"ros_base": NODES["ros_base"]}))
    loop.run(until_ns=loop.now_ns + 2_000_000_000)
    assert not topics & {"base/cmd_vel", "wheel_ticks", "diagnostics", "board_connected"}
    system.stop()


def test_a_timeout_belongs_to_a_ros_base(tmp_path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("like: chefbot\nname: mine\ndrive: {command_timeout: 0.2 s}\n")
    with pytest.raises(RobotFileError, match=r"drive\.command_timeout: is for a drive of protocol ros2 only"):
        load_robot(str(path))
    path.write_text("like: chefbot\nname: mine\ndrive: {protocol: ros2, command_timeout: 20 s}\n")
    with pytest.raises(ChefbotError, match=r"drive\.command_timeout: 20 s must be at most 1 s"):
        load_robot(str(path))
    path.write_text("like: chefbot\nname: mine\ndrive: {protocol: ros2, command_timeout: 200 ms}\n")
    assert load_robot(str(path)).drive.command_timeout == pytest.approx(0.2)
