"""The drive base: who drives, how speeds change, and what stops the wheels at once."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import pytest
from tests.support.base_bench import LIDAR_ROBOT, TICK, BaseBench

from chefbot.board.sensors import cliff_messages
from chefbot.control.kinematics import wheel_speeds
from chefbot.msgs.diagnostic_msgs import ERROR
from chefbot.msgs.geometry_msgs import Vector3
from chefbot.msgs.sensor_msgs import Imu
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.nodes.drive_base import HELD
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import GRAVITY
from chefbot.runtime.launch import node_params
from chefbot.safety.stop_latch import TIPPED_OVER

LIMITS = Limits.of(LIDAR_ROBOT)
CLIFF_ROBOT = load_robot("chefbot_cliff")
FRONT, REAR = 1, 8


def bench(**params: Any) -> BaseBench:
    return BaseBench(sensors=False, **params)


def test_a_twist_begins_with_a_ramp_and_reaches_the_wheels() -> None:
    base = bench()
    base.run(TICK, "cmd_vel_nav", 0.3, -0.5)
    v, w = base.twist_out
    assert v == pytest.approx(LIMITS.acceleration * TICK) and w == pytest.approx(v * -0.5 / 0.3)
    base.run(2.0, "cmd_vel_nav", 0.3, -0.5)
    assert base.twist_out == pytest.approx((0.3, -0.5))
    wheels = base.messages("wheel_speeds")[-1]
    assert (wheels.left, wheels.right) == pytest.approx(wheel_speeds(0.3, -0.5, LIDAR_ROBOT))
    assert wheels.header.frame_id == "base_link" and wheels.header.stamp.ns == base.loop.now_ns
    twists = base.messages("cmd_vel")
    steps = [abs(b.linear.x - a.linear.x) for a, b in pairwise(twists)]
    assert max(steps) <= LIMITS.acceleration * TICK + 1e-9


def test_commands_go_to_the_wheels_at_20_hz() -> None:
    base = bench()
    count = len(base.messages("wheel_speeds"))
    base.run(2.0)
    assert len(base.messages("wheel_speeds")) - count == 40


def test_teleoperation_overrides_navigation_for_a_second() -> None:
    base = bench()
    base.run(1.0, "cmd_vel_nav", 0.2)
    base.twist("cmd_vel_teleop", -0.1)
    base.run(0.9, "cmd_vel_nav", 0.2)
    assert base.speed <= 0.0
    base.run(1.0, "cmd_vel_nav", 0.2)
    assert base.speed == pytest.approx(0.2)


def test_a_command_that_is_not_repeated_is_a_stop() -> None:
    base = bench()
    base.run(1.0, "cmd_vel_nav", 0.3)
    base.run(0.25)
    assert base.speed == pytest.approx(0.3)
    base.run(0.3)
    assert base.speed == 0.0


def test_a_lost_process_stops_the_wheels_at_once() -> None:
    """Without a ramp and before the next command is due; an operator may drive on, navigation not."""
    base = bench()
    base.run(1.0, "cmd_vel_nav", 0.3)
    base.send("process_lost", String("slam"))
    assert base.speed == 0.0 and base.messages("wheel_speeds")[-1].left == 0.0
    assert base.texts("base/notice") == ["slam does not respond; the robot stops until it responds again."]
    base.run(1.0, "cmd_vel_nav", 0.3)
    assert base.speed == 0.0
    base.run(0.5, "cmd_vel_teleop", 0.1)
    assert base.speed == pytest.approx(0.1)
    base.send("process_back", String("slam"))
    base.run(2.0, "cmd_vel_nav", 0.3)
    assert base.speed == pytest.approx(0.3)


def test_parameters_apply_from_the_next_command_on() -> None:
    base = bench(teleop_hold=0.2)
    base.run(1.0, "cmd_vel_teleop", 0.3)
    old = base.node.params
    monitor = {"optional_sensors": ["lidar", "depth camera", "ultrasonic ranger"], "slowdown_ratio": 0.25}
    values = {"limiter": {"timeout": 0.1}, "teleop_hold": 0.5, "ultrasonic_margin": 0.1, "monitor": monitor}
    new = node_params(type(base.node), values, "base")
    base.node.reconfigure(new)
    assert base.node.params is new is not old
    base.run(0.2)
    assert base.speed < 0.28, "a command is a stop after 0.1 s"
    base.run(0.2, "cmd_vel_nav", -0.3)
    assert base.speed >= 0.0, "teleoperation is held for half a second"
    assert base.node._monitor.params.slowdown_ratio == 0.25 and base.node._monitor._ultrasonic_margin == 0.1


# -- cliffs


def cliffs(base: BaseBench, seen: int) -> None:
    for message in cliff_messages(base.loop.now_ns, seen, CLIFF_ROBOT):
        base.loop.publish("cliff", message, "board")
    base.run(0.0)


def drive_on_floor(base: BaseBench, v: float, w: float = 0.0) -> None:
    for _ in range(20):
        cliffs(base, 0)
        base.run(TICK, "cmd_vel_nav", v, w)


@pytest.mark.parametrize(
    ("v", "cliff", "stops"), [(0.2, FRONT, True), (-0.2, REAR, True), (0.2, REAR, False)]
)
def test_a_cliff_stops_the_wheels_at_once(v: float, cliff: int, stops: bool) -> None:
    base = BaseBench(CLIFF_ROBOT, sensors=False)
    base.node._monitor._sensors = LIDAR_ROBOT.sensors  # the ground behind is known
    drive_on_floor(base, v)
    assert base.speed == pytest.approx(v)
    cliffs(base, cliff)
    assert base.speed == (0.0 if stops else pytest.approx(v))
    base.run(TICK, "cmd_vel_nav", v)
    assert base.speed == (0.0 if stops else pytest.approx(v))
    assert base.texts("collision_monitor/reason")[-1:] == base.texts("base/notice")
    reports = base.messages("cause_reports")
    assert [report.kind for report in reports] == ["stop"] * stops
    assert all("sees no floor" in report.sentence and report.check == "sensor data" for report in reports)
    notices = base.texts("base/notice")
    assert len(notices) == stops and all("sees no floor" in notice for notice in notices)


def test_turning_at_a_cliff_goes_on() -> None:
    base = BaseBench(CLIFF_ROBOT, sensors=False)
    drive_on_floor(base, 0.0, 1.0)
    count = len(base.messages("cmd_vel"))
    cliffs(base, FRONT | REAR)
    assert len(base.messages("cmd_vel")) == count, "nothing is stopped"
    base.run(0.2, "cmd_vel_nav", 0.2, 1.0)
    v, w = base.twist_out
    assert v == 0.0 and w == pytest.approx(1.0)
    base.run(0.2, "cmd_vel_nav", 0.0, 1.0)
    assert base.twist_out == pytest.approx((0.0, 1.0)) and base.texts("collision_monitor/reason")[-1] == ""


# -- a sensor fails while an operator drives


def test_a_silent_lidar_stops_at_once_and_stick_has_to_be_let_go() -> None:
    base = BaseBench()
    base.run(2.0, "cmd_vel_teleop", 0.3)
    assert base.speed == pytest.approx(0.3)
    base.silent.add("lidar")
    base.run(0.35, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0, "within 300 ms of the last scan, without a ramp"
    base.run(1.0, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0
    assert base.texts("base/stop_reason")[-1] == "The lidar has sent nothing for more than 0.3 s."
    base.run(0.4)
    base.run(1.0, "cmd_vel_teleop", 0.3)
    assert 0.0 < base.speed <= 0.0401, "let go and pushed again, the robot creeps"
    base.run(1.0, "cmd_vel_nav", 0.3)
    base.run(0.5, "cmd_vel_nav", 0.3)
    assert base.speed == 0.0, "only an operator creeps"
    report = base.messages("cause_reports")[-1]
    assert (report.kind, report.check) == ("stop", "sensor data")
    assert "lidar has sent nothing" in report.sentence
    base.silent.clear()
    base.run(3.0, "cmd_vel_nav", 0.3)
    assert base.speed == pytest.approx(0.3) and base.texts("base/stop_reason")[-1] == ""


ENCODER = "The left encoder is silent or counts against the motor. The motors are off; press STOP, then Release STOP."


@pytest.mark.parametrize("topic", ["cmd_vel_nav", "cmd_vel_teleop"])
def test_motors_that_are_off_are_the_reason_to_stand(topic: str) -> None:
    base = BaseBench()
    base.run(2.0, topic, 0.3)
    base.send("board_fault", String(ENCODER))
    base.run(TICK, topic, 0.3)
    assert base.speed == 0.0 and base.texts("base/stop_reason")[-1] == ENCODER, "at once, without a ramp"
    base.run(0.5 - TICK, topic, 0.3)
    assert base.texts("collision_monitor/reason")[-1] == ENCODER
    base.run(0.5)
    base.run(1.0, topic, 0.3)
    assert base.speed == 0.0, "not even slowly"
    report = base.messages("cause_reports")[-1]
    assert (report.kind, report.sentence) == ("stop", ENCODER)
    base.run(1.0)
    status = base.messages("diagnostics")[-1].status[0]
    assert (status.level, status.message) == (ERROR, ENCODER)
    base.send("board_fault", String(""))
    base.run(2.0, topic, 0.3)
    assert base.speed == pytest.approx(0.3)
    assert base.texts("base/stop_reason")[-1] == base.texts("collision_monitor/reason")[-1] == ""


def test_a_held_stick_does_not_drive_once_the_motors_are_back() -> None:
    base = BaseBench()
    base.run(2.0, "cmd_vel_teleop", 0.3)
    base.send("board_fault", String(ENCODER))
    base.run(0.5, "cmd_vel_teleop", 0.3)
    base.send("board_fault", String(""))
    base.run(1.0, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0 and base.texts("collision_monitor/reason")[-1] == HELD


def test_a_held_stick_is_named_once_the_lidar_is_back() -> None:
    base = BaseBench()
    base.run(2.0, "cmd_vel_teleop", 0.3)
    base.silent.add("lidar")
    base.run(0.5, "cmd_vel_teleop", 0.3)
    assert base.texts("collision_monitor/reason")[-1].startswith("The lidar has sent nothing")
    base.silent.clear()
    base.run(2.0, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0 and base.texts("collision_monitor/reason")[-1] == HELD
    base.run(0.4)
    assert base.texts("collision_monitor/reason")[-1] == ""


def test_under_the_emergency_stop_nothing_is_explained() -> None:
    base = bench()
    base.run(1.0, "cmd_vel_teleop", 0.3)
    base.send("stop_request", Bool(True))
    base.run(1.0, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0 and base.texts("collision_monitor/reason") == []
    base.send("stop_request", Bool(False))
    base.run(1.0, "cmd_vel_teleop", 0.3)
    assert base.speed == 0.0 and base.texts("collision_monitor/reason") == [HELD]


def test_a_robot_that_sees_one_plane_warns_at_the_start() -> None:
    assert "one plane only" in BaseBench(load_robot("jackal"), sensors=False).node.announcement
    assert bench().node.announcement == ""


@pytest.mark.parametrize("w", [0.0, 0.2])
def test_before_a_wall_the_twist_shrinks_on_its_arc(w: float) -> None:
    """The wheels get what the monitor leaves, and the ramp goes on from there, not from what was commanded."""
    base = BaseBench(monitor={"optional_sensors": ["depth camera"]})
    base.silent.add("depth camera")  # it would remember the wall, which is nearer than it sees
    base.wall = 0.9
    for _ in range(200):
        base.run(TICK, "cmd_vel_nav", 0.3, w)
        v, rate = base.twist_out
        assert 0.0 <= v <= 0.3 and rate == pytest.approx(v * w / 0.3, abs=0.02)
    assert v < 0.05 and base.wall - base.pose.x > LIDAR_ROBOT.circumscribed_radius
    (report,) = base.messages("cause_reports")[-1:]
    assert report.check == "collision monitor" and "sees an obstacle" in report.sentence
    base.wall = 5.0
    for _ in range(20):
        before = base.speed
        base.run(TICK, "cmd_vel_nav", 0.3, w)
        assert base.speed <= before + LIMITS.acceleration * TICK + 1e-9
    assert base.speed > 0.2 and base.messages("cause_reports")[-1].kind == "end"


# -- a robot that tips over


def imu(base: BaseBench, degrees: float, rate: float = 0.0) -> None:
    """Publish a reading of a robot that is pitched forward by an angle and turns at a rate, rad/s."""
    angle = math.radians(degrees)
    force = Vector3(-GRAVITY * math.sin(angle), 0.0, GRAVITY * math.cos(angle))
    header = Header.of(base.loop.now_ns, "imu_link")
    base.loop.publish(
        "imu/data", Imu(header, angular_velocity=Vector3(0.0, rate), linear_acceleration=force), "board"
    )


def pitch(base: BaseBench, begin: float, end: float, seconds: float, v: float) -> None:
    """Pitch from an angle to another, degrees, in a time, while navigation commands v."""
    steps = round(seconds / TICK)
    for i in range(1, steps + 1):
        imu(base, begin + (end - begin) * i / steps, math.radians(end - begin) / seconds)
        base.run(TICK, "cmd_vel_nav", v)


def test_a_robot_that_tips_over_is_stopped() -> None:
    base = bench()
    pitch(base, 0.0, 0.0, 2.0, 0.2)
    assert base.speed == pytest.approx(0.2)
    pitch(base, 0.0, 90.0, 0.5, 0.2)
    pitch(base, 90.0, 90.0, 2.0, 0.2)
    assert base.twist_out == (0.0, 0.0)
    assert base.texts("base/notice") == [TIPPED_OVER]
    status = base.messages("stop_status")[-1]
    assert status.active and not status.held and status.description == TIPPED_OVER
    # Upright, it stays where it is until a person releases the emergency stop
    pitch(base, 90.0, 0.0, 1.0, 0.2)
    pitch(base, 0.0, 0.0, 2.5, 0.2)
    assert base.speed == 0.0
    base.run(1.0)
    base.send("stop_request", Bool(False))
    pitch(base, 0.0, 0.0, 2.0, 0.2)
    assert base.speed == pytest.approx(0.2)


def test_a_release_while_the_robot_lies_is_refused() -> None:
    """It would drive off in the hands of the person who sets it upright."""
    base = bench()
    pitch(base, 0.0, 0.0, 2.0, 0.2)
    pitch(base, 0.0, 90.0, 0.5, 0.2)
    base.run(1.0)
    base.send("stop_request", Bool(False))
    pitch(base, 90.0, 90.0, 2.0, 0.2)
    assert base.twist_out == (0.0, 0.0) and base.messages("stop_status")[-1].active
    assert base.texts("base/notice") == [TIPPED_OVER, TIPPED_OVER]
    assert base.texts("collision_monitor/reason")[-1] == TIPPED_OVER
    assert base.messages("stop_status")[-1].description == TIPPED_OVER
    base.twist("cmd_vel_teleop", 0.1, 0.3)
    base.run(TICK)
    assert base.twist_out == (0.0, 0.0), "by hand neither"
    pitch(base, 90.0, 0.0, 1.0, 0.2)
    pitch(base, 0.0, 0.0, 2.5, 0.2)
    assert base.speed == 0.0, "upright, it waits for the release"
    base.run(1.0)
    base.send("stop_request", Bool(False))
    pitch(base, 0.0, 0.0, 2.0, 0.2)
    assert base.speed == pytest.approx(0.2) and base.texts("collision_monitor/reason")[-1] == ""


def test_the_wheels_stop_without_a_ramp_when_it_tips_over() -> None:
    base = bench()
    pitch(base, 0.0, 0.0, 2.0, 0.3)
    before = len(base.messages("cmd_vel"))
    pitch(base, 0.0, 90.0, 0.5, 0.3)
    speeds = {round(twist.linear.x, 6) for twist in base.messages("cmd_vel")[before:]}
    assert speeds == {0.3, 0.0}
