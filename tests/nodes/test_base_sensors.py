"""The collision monitor's node: from scans, transforms and echoes to what the wheels get, and the reason for it."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from tests.support.base_bench import BINS, LIDAR_ROBOT, NO_SENSORS, TICK, BaseBench

from chefbot.maths.se2 import SE2
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.collision_monitor import OK_MESSAGE

RADIUS = LIDAR_ROBOT.circumscribed_radius


def drive(base: BaseBench, seconds: float, v: float = 0.35, w: float = 0.0) -> None:
    base.run(seconds, "cmd_vel_nav", v, w)


def reasons(base: BaseBench) -> list[str]:
    return base.texts("collision_monitor/reason")


def standing(base: BaseBench) -> list[str]:
    return base.texts("base/stop_reason")


def health(base: BaseBench) -> tuple[int, str]:
    (status,) = base.messages("diagnostics")[-1].status
    assert status.name == "collision monitor" and status.hardware_id == LIDAR_ROBOT.name
    return status.level, status.message


def test_it_stands_until_the_sensors_have_sent() -> None:
    base = BaseBench()
    drive(base, 0.2)
    assert base.speed == 0.0 and standing(base)[0] == "The lidar has not sent anything yet."
    drive(base, 3.0)
    assert base.speed == pytest.approx(0.35) and standing(base)[-1] == ""
    assert health(base) == (OK, OK_MESSAGE)


def test_it_stops_before_a_wall_and_names_the_sensor() -> None:
    base = BaseBench()
    base.wall = 1.5
    drive(base, 8.0)
    gap = base.wall - base.pose.x - RADIUS
    assert 0.0 < gap < 0.08 and abs(base.speed) < 0.02
    # the nearest point of either sensor
    assert " sees an obstacle 0.0" in reasons(base)[-1] and reasons(base)[-1].endswith("m ahead.")
    assert any(reason.startswith("Slowed: ") for reason in reasons(base))
    level, message = health(base)
    assert (level, message) == (WARN, reasons(base)[-1])
    drive(base, 0.6, -0.2)
    assert base.speed < -0.15 and reasons(base)[-1] == "", "the way back is free"


def test_a_wall_that_only_one_sensor_sees_stops_it() -> None:
    """Both sensors reach the monitor: an optional one is silent in each case."""
    for blind, name in (("lidar", "depth camera"), ("depth camera", "lidar")):
        base = BaseBench(monitor={"optional_sensors": [blind]})
        base.silent.add(blind)
        base.wall = 1.2
        drive(base, 7.0)
        assert 0.0 < base.wall - base.pose.x - RADIUS < 0.08
        assert f"the {name} s" in reasons(base)[-1]


def test_an_echo_stops_it() -> None:
    base = BaseBench()
    base.run(1.0)
    base.echo = 0.06
    drive(base, 0.1)
    drive(base, 0.5)
    assert base.speed < 0.05 and "ultrasonic ranger" in reasons(base)[-1]


@pytest.mark.parametrize(("silent", "sentence"), [
    ("lidar", "The lidar has sent nothing for more than 0.3 s."),
    ("depth camera", "The depth camera has sent nothing for more than 0.3 s."),
    ("odometry", "There is no transform from base_link to odom for the lidar; check the odometry"),
])  # fmt: skip
def test_what_is_silent_stops_the_wheels_within_300_ms(silent: str, sentence: str) -> None:
    base = BaseBench()
    drive(base, 3.0)
    assert base.speed == pytest.approx(0.35)
    base.silent.add(silent)
    last = base.messages("obstacles" if silent == "depth camera" else "scan")[-1].header.stamp.ns
    speeds, times_ns = [], []
    for _ in range(8):
        drive(base, TICK)
        speeds.append(base.speed)
        times_ns.append(base.loop.now_ns)
    # the verdict is on when the next command is due: one period later the data would be too old
    stopped = speeds.index(0.0)
    assert min(speeds[:stopped]) > 0.3 and not any(speeds[stopped:])
    assert times_ns[stopped] - last == 300_000_000, "the last data that could be placed"
    assert standing(base)[-1].startswith(sentence)
    base.run(1.1)
    level, message = health(base)
    assert level == ERROR and message.startswith(sentence)
    base.silent.clear()
    drive(base, 3.0)
    assert base.speed > 0.3 and standing(base)[-1] == ""


def test_a_silent_ranger_slows_the_robot() -> None:
    base = BaseBench()
    base.silent.add("ultrasonic ranger")
    drive(base, 3.0)
    assert base.speed == pytest.approx(0.5 * 0.35)
    assert (
        reasons(base)[-1] == "The ultrasonic ranger has not sent anything yet." and standing(base)[-1] == ""
    )
    assert health(base)[0] == WARN


def test_without_odometry_nothing_is_placed() -> None:
    base = BaseBench()
    base.silent.add("odometry")
    drive(base, 1.0)
    assert base.speed == 0.0 and "There is no transform from" in standing(base)[-1]


def test_a_fixed_robot_on_a_stand_has_odometry_without_a_time() -> None:
    base = BaseBench()
    base.silent.add("odometry")
    fixed = TransformStamped.of(0, "odom", "base_link", SE2(0.0, 0.0, 0.0))
    base.send("tf_static", TFMessage((fixed,)))
    drive(base, 3.0)
    assert base.speed == pytest.approx(0.35)


def test_its_report_is_repeated_each_second() -> None:
    """Others can publish these topics as well; the operator sees the truth within a second."""
    base = BaseBench()
    base.run(2.0)
    base.send("base/stop_reason", String("nonsense"))
    base.run(1.05)
    assert standing(base)[-1] == ""
    assert len(base.messages("diagnostics")) == 3


def test_standing_is_published_when_it_changes() -> None:
    base = BaseBench()
    base.run(0.1)
    base.run(2.9)
    changes = [text for k, text in enumerate(standing(base)) if k == 0 or text != standing(base)[k - 1]]
    assert changes == ["The lidar has not sent anything yet.", ""]
    assert len(standing(base)) <= 2 + 3, "once a second besides"


@pytest.mark.parametrize("lag", [1, 8])
def test_the_latency_of_the_wheels_is_learnt(lag: int) -> None:
    """From commands and odometry; a robot that answers later brakes earlier."""
    base = BaseBench()
    base.lag = lag
    for k in range(12):
        drive(base, 0.7, 0.3 if k % 2 else -0.3)
    assert base.node._latency.latency == pytest.approx(lag * TICK, abs=0.06)


def test_the_speed_for_the_latency_is_that_of_the_odometry() -> None:
    base, speeds = BaseBench(), []
    base.run(3.0)
    base.node._latency.process = lambda commanded, measured: speeds.append((commanded, measured))
    drive(base, 2.0, 0.3)
    assert speeds[-1] == pytest.approx((0.3, 0.3)) and len(speeds) >= 39


def test_an_old_pose_makes_it_brake_earlier() -> None:
    """What the odometry does not show yet, the robot has driven already: it stops farther away from a wall."""
    gaps = []
    for delay in (0.0, 0.2):
        base = BaseBench()
        base.wall, base.pose_delay = 1.2, delay
        drive(base, 2.2)
        gaps.append(base.speed)
    assert gaps[1] < gaps[0] - 0.03


def test_an_age_of_the_pose_counts_for_a_second_at_most() -> None:
    """A pose of an hour ago, or of the future, is a fault of its own; it is not a distance driven by the robot."""
    base = BaseBench(monitor=NO_SENSORS)
    base.silent |= {"lidar", "depth camera"}
    latencies = []
    check = base.node._monitor.check

    def noted(v: float, w: float, pose: SE2, now_ns: int, latency: float) -> object:
        latencies.append(latency)
        return check(v, w, pose, now_ns, latency)

    base.node._monitor.check = noted
    base.run(0.2)
    base.silent.add("odometry")
    base.run(3.0)
    assert latencies[0] == pytest.approx(0.15 + TICK + TICK), "the pose is of one tick ago"
    assert latencies[12] == pytest.approx(0.15 + TICK + 0.5, abs=0.06)
    assert latencies[-1] == pytest.approx(0.15 + TICK + 1.0)
    fixed = BaseBench(monitor=NO_SENSORS)
    fixed.silent |= {"lidar", "depth camera", "odometry"}
    fixed.send("tf_static", TFMessage((TransformStamped.of(0, "odom", "base_link", SE2(0.0, 0.0, 0.0)),)))
    fixed.node._monitor.check = noted
    fixed.run(3.0)
    assert latencies[-1] == pytest.approx(0.15 + TICK), "what is fixed is never old"
    ahead = BaseBench()
    ahead.pose_delay = -0.09
    ahead.node._monitor.check = noted
    ahead.run(0.5)
    assert latencies[-1] == pytest.approx(0.15 + TICK)


@pytest.mark.parametrize(("wall", "blind"), [(0.5, False), (0.6, False), (math.inf, True)])
def test_a_camera_before_a_known_wall_is_not_blind(wall: float, blind: bool) -> None:
    """What the monitor remembers explains that the camera measures nothing; in the open, nothing explains it."""
    base = BaseBench()
    base.wall = wall
    base.run(1.5)
    base.silent.add("depth camera")
    last = base.messages("obstacles")[-1]
    nothing = {"ranges": np.full(BINS, np.inf, np.float32), "clear_to": np.zeros(BINS, np.float32)}
    base.send("obstacles", msgspec.structs.replace(last, **nothing))
    drive(base, 0.1)
    assert any("camera is blind" in reason for reason in reasons(base)) == blind
    assert (base.speed == 0.0) == blind


def test_a_lidar_beside_the_middle_marks_where_it_is() -> None:
    """The scan is placed by the transform of its own frame, mounted askew."""
    base = BaseBench()
    mounted = TransformStamped.of(0, "base_link", "askew", SE2(0.0, 0.1, math.pi / 2))
    base.send("tf_static", TFMessage((mounted,)))
    base.run(0.2)
    base.silent |= {"lidar", "depth camera"}
    last = base.messages("scan")[-1]
    ranges = np.full(len(last.ranges), np.inf, np.float32)
    ranges[np.argmin(np.abs(last.angles + math.pi / 2))] = (
        0.4  # to the right of the lidar, ahead of the robot
    )
    base.send("scan", msgspec.structs.replace(last, header=Header(last.header.stamp, "askew"), ranges=ranges))
    points = base.node._monitor.points(base.pose, base.loop.now_ns, 0.5)
    assert np.hypot(*(points - [0.4, 0.1]).T).min() < 0.02


def test_an_echo_without_a_ranger_is_not_a_fault() -> None:
    """Another robot's file, the same board: the echo is received, and nothing waits for the next one."""
    robot = msgspec.structs.replace(
        LIDAR_ROBOT, sensors=msgspec.structs.replace(LIDAR_ROBOT.sensors, ultrasonic=None)
    )
    base = BaseBench(robot)
    base.echo = 0.06
    drive(base, 3.0)
    assert base.speed == pytest.approx(0.35) and reasons(base)[-1] == ""
