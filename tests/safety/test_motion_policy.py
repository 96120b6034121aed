"""What the base may do while a sensor fails, and the freshness of the odometry."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.safety.command_multiplexer import CommandMultiplexer, CommandSource, StampedCommand
from chefbot.safety.known_obstacles import RememberedPoints
from chefbot.safety.motion_policy import Restriction, SensorPolicy, SensorVerdict, odometry_fault, restricted

MS = 1_000_000
ROBOT = load_robot("chefbot_lidar")
TELEOP, NAVIGATION = CommandSource.TELEOP, CommandSource.NAVIGATION
NOTHING = RememberedPoints(lambda: np.zeros((0, 2)), 0.025)
ALL = ("lidar", "depth camera", "ultrasonic ranger")


def echo(distance: float, time_ms: int) -> Range:
    return Range(Header.of(time_ms * MS, "ultrasonic_link"), 0, 0.5, 0.02, 4.0, distance)


def feed(policy: SensorPolicy, first_ms: int, last_ms: int, silent: str = "") -> None:
    """Feed good data of all sensors but one, ten times a second."""
    rng = np.random.default_rng(first_ms)
    for time in range(first_ms, last_ms + 1, 100):
        header = Header.of(time * MS, "base_link")
        ranges = (2.0 + 0.01 * rng.standard_normal(360)).astype(np.float32)
        bins = (2.0 + 0.01 * rng.standard_normal(160)).astype(np.float32)
        floor = np.full(160, 0.7, np.float32), np.full(160, 1.9, np.float32)
        if silent != "lidar":
            scan = LaserScan(header, -np.pi, np.pi, np.pi / 180, 0.0, 0.1, 0.16, 8.0, ranges)
            policy.obstacle_sensors.process_scan(scan, time * MS, IDENTITY)
            policy.obstacle_sensors.note_scan_marked(time * MS)
        if silent != "depth camera":
            obstacles = ObstacleScan(header, -0.5, 1.0 / 160, 8.0, bins, *floor)
            policy.obstacle_sensors.process_obstacles(obstacles, time * MS, IDENTITY)
            policy.obstacle_sensors.note_obstacles_marked(time * MS)
        if silent != "ultrasonic ranger" and policy.ranger is not None:
            policy.ranger.process_echo(echo(float(bins[0]), time), time * MS)


def judged(policy: SensorPolicy, time_ms: int, pose_ms: int | None = None) -> SensorVerdict:
    pose_ns = (time_ms if pose_ms is None else pose_ms) * MS
    return policy.judge(time_ms * MS, IDENTITY, pose_ns, NOTHING)


@pytest.mark.parametrize(
    ("silent", "restriction"),
    [
        ("lidar", Restriction.STOP_UNLESS_TELEOP),
        ("depth camera", Restriction.STOP_UNLESS_TELEOP),
        ("ultrasonic ranger", Restriction.SLOW),
    ],
)
def test_a_sensor_that_stops_restricts_until_it_is_back(silent: str, restriction: Restriction) -> None:
    policy = SensorPolicy(ROBOT, ())
    feed(policy, 0, 1000)
    assert judged(policy, 1010) == SensorVerdict(Restriction.NONE)
    feed(policy, 1100, 1500, silent)
    found = judged(policy, 1510)
    assert found.restriction is restriction and silent in found.fault
    assert found.stop_reason == (found.fault if restriction is Restriction.STOP_UNLESS_TELEOP else "")
    feed(policy, 1600, 2200)
    assert judged(policy, 2210) == SensorVerdict(Restriction.NONE)


def test_an_optional_sensor_counts_from_its_first_message_on() -> None:
    assert judged(SensorPolicy(ROBOT, ()), 0).restriction is Restriction.STOP_UNLESS_TELEOP
    policy = SensorPolicy(ROBOT, ALL)
    assert policy.judge(0, None, None, NOTHING) == SensorVerdict(Restriction.NONE)
    feed(policy, 0, 1000)
    assert judged(policy, 1010) == SensorVerdict(Restriction.NONE)
    assert judged(policy, 1400).restriction is Restriction.STOP_UNLESS_TELEOP


def test_late_and_future_odometry_is_named() -> None:
    policy = SensorPolicy(ROBOT, ())
    feed(policy, 0, 1000)
    assert "odometry is late" in judged(policy, 1010, 600).fault
    assert "stamped in the future" in judged(policy, 1010, 1200).fault
    assert "no odometry yet" in odometry_fault(0, None, None)
    assert odometry_fault(10**12, IDENTITY, None) == "", "a fixed transform is never late"


def test_what_is_left_of_a_command() -> None:
    def left(restriction: Restriction, v: float, w: float, source: CommandSource = TELEOP) -> float:
        return restricted(StampedCommand(v, w, 0, source), SensorVerdict(restriction, "x"), 0.15, 0.14)

    assert left(Restriction.NONE, 0.35, 1.0) == 1.0 and left(Restriction.STOP_UNLESS_TELEOP, 0.0, 0.0) == 1.0
    assert left(Restriction.STOP_UNLESS_TELEOP, 0.35, 0.0, NAVIGATION) == 0.0
    assert left(Restriction.STOP_UNLESS_TELEOP, 0.35, 0.0) == pytest.approx(0.04 / 0.35)
    assert left(Restriction.SLOW, 0.35, 0.0) == pytest.approx(0.4) and left(Restriction.SLOW, 0.0, 1.0) == 1.0
    assert left(Restriction.NO_FORWARD, -0.35, 0.0, NAVIGATION) == 1.0
    assert left(Restriction.NO_FORWARD, 0.35, 0.0) == 0.0


def test_an_interrupted_operator_has_to_let_go() -> None:
    commands = CommandMultiplexer(1.0)
    commands.accept(TELEOP, 0.3, 0.0, 0, stopped=False)
    commands.interrupt(TELEOP, 10 * MS)
    for time in range(100, 1000, 100):
        commands.accept(TELEOP, 0.3, 0.0, time * MS, stopped=False)
        assert commands.select(time * MS).v == 0.0
    commands.accept(TELEOP, 0.0, 0.0, 1000 * MS, stopped=False)
    commands.accept(TELEOP, 0.3, 0.0, 1100 * MS, stopped=False)
    assert commands.select(1100 * MS) == StampedCommand(0.3, 0.0, 1100 * MS, TELEOP)
    commands.interrupt(NAVIGATION, 1200 * MS)  # without a command


@pytest.mark.parametrize(
    ("age_ms", "fault"),
    [
        (300, ""),
        (301, "The odometry is late: the newest pose is 0.3 s old."),
        (2500, "The odometry is late: the newest pose is 2.5 s old."),
        (-100, ""),
        (-101, "The odometry is stamped in the future: compare its computer's clock with this one's."),
    ],
)
def test_odometry_counts_for_300_ms(age_ms: int, fault: str) -> None:
    assert odometry_fault(10_000 * MS, IDENTITY, (10_000 - age_ms) * MS) == fault


@pytest.mark.parametrize(
    ("restriction", "v", "w", "left"),
    [
        (Restriction.STOP_UNLESS_TELEOP, 0.1, 2.0, 0.04 / 0.4),
        (Restriction.STOP_UNLESS_TELEOP, -0.1, -2.0, 0.04 / 0.4),
        (Restriction.STOP_UNLESS_TELEOP, 0.02, 0.0, 1.0),
        (Restriction.STOP_UNLESS_TELEOP, 0.0, -2.0, 0.04 / 0.3),
        (Restriction.SLOW, -0.28, 1.0, 0.5),
        (Restriction.SLOW, 0.1, 0.0, 1.0),
        (Restriction.NO_FORWARD, 0.0, 1.0, 1.0),
        (Restriction.NO_FORWARD, 0.0001, 1.0, 0.0),
        (Restriction.NO_FORWARD, math.nan, 0.0, 0.0),
        (Restriction.NONE, 9.0, 9.0, 1.0),
    ],
)
def test_restrictions_limit_backwards_and_turning(
    restriction: Restriction, v: float, w: float, left: float
) -> None:
    """The fastest point of a body of 0.15 m; slow is 0.14 m/s."""
    verdict = SensorVerdict(restriction, "x")
    assert restricted(StampedCommand(v, w, 0, TELEOP), verdict, 0.15, 0.14) == pytest.approx(left)


def test_nobody_drives_while_the_motors_are_off() -> None:
    seen = SensorVerdict(Restriction.SLOW, "ranger")
    assert seen.with_board_fault("") is seen and not seen.requires_stop
    verdict = seen.with_board_fault("encoder")
    assert verdict == SensorVerdict(Restriction.STOP, "encoder")
    assert verdict.requires_stop and verdict.stop_reason == "encoder"
    for source in (TELEOP, NAVIGATION, None):
        for twist in ((0.3, 0.0), (-0.3, 0.0), (0.0, 1.0), (0.001, 0.001)):
            assert restricted(StampedCommand(*twist, 0, source), verdict, 0.15, 0.14) == 0.0


def test_nobody_but_an_operator_creeps() -> None:
    for source in (NAVIGATION, None):
        command = StampedCommand(0.3, 0.0, 0, source)
        assert restricted(command, SensorVerdict(Restriction.STOP_UNLESS_TELEOP, "x"), 0.15, 0.14) == 0.0


def test_odometry_is_needed_by_who_sees_only() -> None:
    """Points are placed by the odometry; a robot without lidar and camera has none to place."""
    blind = msgspec.structs.replace(
        ROBOT, sensors=msgspec.structs.replace(ROBOT.sensors, lidar=None, depth_camera=None, ultrasonic=None)
    )
    assert SensorPolicy(blind, ()).judge(0, None, None, NOTHING) == SensorVerdict(Restriction.NONE)
    for missing in ("lidar", "depth_camera"):
        sensors = msgspec.structs.replace(ROBOT.sensors, **{missing: None})
        policy = SensorPolicy(msgspec.structs.replace(ROBOT, sensors=sensors), ())
        feed(policy, 0, 1000)
        assert policy.judge(1010 * MS, IDENTITY, 1010 * MS, NOTHING).restriction is Restriction.NONE
        lost = policy.judge(1010 * MS, None, None, NOTHING)
        assert lost.restriction is Restriction.STOP_UNLESS_TELEOP and "no odometry yet" in lost.stop_reason


def test_a_fault_of_a_sensor_is_named_before_the_odometry() -> None:
    assert "has not sent anything" in SensorPolicy(ROBOT, ()).judge(0, None, None, NOTHING).fault


def test_an_optional_ranger_is_missed_once_it_has_sent() -> None:
    policy = SensorPolicy(ROBOT, ("ultrasonic ranger",))
    feed(policy, 0, 1000, "ultrasonic ranger")
    assert judged(policy, 1010) == SensorVerdict(Restriction.NONE)
    needed = SensorPolicy(ROBOT, ())
    feed(needed, 0, 1000, "ultrasonic ranger")
    assert judged(needed, 1010).restriction is Restriction.SLOW
    feed(policy, 1100, 1500)
    feed(policy, 1600, 2200, "ultrasonic ranger")
    assert judged(policy, 2210).restriction is Restriction.SLOW


def test_the_ranger_of_a_robot_has_its_own_rate() -> None:
    assert ROBOT.sensors.ultrasonic is not None
    slow = msgspec.structs.replace(
        ROBOT.sensors, ultrasonic=msgspec.structs.replace(ROBOT.sensors.ultrasonic, rate=2.0)
    )
    policy = SensorPolicy(msgspec.structs.replace(ROBOT, sensors=slow), ())
    assert policy.ranger is not None and policy.ranger.limit_ns == 1_500_000_000


def test_a_blind_camera_forbids_driving_forward() -> None:
    """What it does not see near a known obstacle is explained; what it does not see anywhere is not."""
    policy = SensorPolicy(ROBOT, ())
    feed(policy, 0, 1000)
    header, n = Header.of(1100 * MS, "base_link"), 160
    empty = ObstacleScan(
        header, -0.5, 1.0 / n, 8.0, *(np.full(n, np.inf, np.float32),) * 2, np.zeros(n, np.float32)
    )
    policy.obstacle_sensors.process_obstacles(empty, 1100 * MS, IDENTITY)
    found = judged(policy, 1110)
    assert found.restriction is Restriction.NO_FORWARD and "blind" in found.fault and found.stop_reason == ""


@given(
    first=st.sets(st.sampled_from(list(Restriction)), min_size=1),
    more=st.sets(st.sampled_from(list(Restriction))),
    v=st.floats(-1.0, 1.0),
    w=st.floats(-3.0, 3.0),
    source=st.sampled_from([TELEOP, NAVIGATION, None]),
    slow=st.floats(0.01, 0.5),
)
def test_a_further_fault_never_allows_more(
    first: set[Restriction],
    more: set[Restriction],
    v: float,
    w: float,
    source: CommandSource | None,
    slow: float,
) -> None:
    def left(restrictions: set[Restriction]) -> float:
        one, *others = sorted(restrictions, key=lambda one: one.value)
        verdict = SensorVerdict(one, "x", tuple(others))
        return restricted(StampedCommand(v, w, 0, source), verdict, 0.15, slow)

    assert left(first | more) == min(left(first), left(more) if more else 1.0)


def test_faults_of_several_sensors_restrict_together() -> None:
    """The one that stops the robot is named; a ranger that fails as well slows a reverse before a blind camera."""
    policy = SensorPolicy(ROBOT, ())
    feed(policy, 0, 1000)
    feed(policy, 1100, 1500, "ultrasonic ranger")
    header, n = Header.of(1510 * MS, "base_link"), 160
    empty = ObstacleScan(
        header, -0.5, 1.0 / n, 8.0, *(np.full(n, np.inf, np.float32),) * 2, np.zeros(n, np.float32)
    )
    policy.obstacle_sensors.process_obstacles(empty, 1510 * MS, IDENTITY)
    both = judged(policy, 1520)
    assert (both.restriction, both.others) == (Restriction.NO_FORWARD, (Restriction.SLOW,))
    assert "blind" in both.fault
    back = StampedCommand(-0.28, 0.0, 0, NAVIGATION)
    assert restricted(back, both, 0.15, 0.14) == pytest.approx(0.5)
    late = judged(policy, 1520, 600)
    assert late.restriction is Restriction.STOP_UNLESS_TELEOP and "odometry is late" in late.fault
    assert late.others == (Restriction.NO_FORWARD, Restriction.SLOW)
    assert restricted(StampedCommand(0.1, 0.0, 0, TELEOP), late, 0.15, 0.14) == 0.0
    lost = policy.judge(1520 * MS, None, None, NOTHING)
    assert lost.restriction is Restriction.STOP_UNLESS_TELEOP and lost.others == (Restriction.SLOW,)
