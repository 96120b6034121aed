"""What the base may do while a sensor fails, and the freshness of ranger and odometry."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.safety.command_multiplexer import CommandMultiplexer, CommandSource, StampedCommand
from chefbot.safety.latency import LatencyEstimator
from chefbot.safety.motion_policy import Restriction, SensorPolicy, SensorVerdict, odometry_fault, restricted
from chefbot.safety.ranger_freshness import FROZEN_ECHOES, NOISY_ECHOES, RangerMonitor

MS = 1_000_000
ROBOT = load_robot("chefbot_lidar")
TELEOP, NAVIGATION = CommandSource.TELEOP, CommandSource.NAVIGATION
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
    return policy.judge(time_ms * MS, IDENTITY, pose_ns, lambda: np.zeros((0, 2)))


@pytest.mark.parametrize(
    ("silent", "restriction"),
    [
        ("lidar", Restriction.CREEP),
        ("depth camera", Restriction.CREEP),
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
    assert found.standing == (found.fault if restriction is Restriction.CREEP else "")
    feed(policy, 1600, 2200)
    assert judged(policy, 2210) == SensorVerdict(Restriction.NONE)


def test_an_optional_sensor_counts_from_its_first_message_on() -> None:
    assert judged(SensorPolicy(ROBOT, ()), 0).restriction is Restriction.CREEP
    policy = SensorPolicy(ROBOT, ALL)
    assert policy.judge(0, None, None, lambda: np.zeros((0, 2))) == SensorVerdict(Restriction.NONE)
    feed(policy, 0, 1000)
    assert judged(policy, 1010) == SensorVerdict(Restriction.NONE)
    assert judged(policy, 1400).restriction is Restriction.CREEP


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

    assert left(Restriction.NONE, 0.35, 1.0) == 1.0 and left(Restriction.CREEP, 0.0, 0.0) == 1.0
    assert left(Restriction.CREEP, 0.35, 0.0, NAVIGATION) == 0.0
    assert left(Restriction.CREEP, 0.35, 0.0) == pytest.approx(0.04 / 0.35)
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


def test_a_frozen_ranger_is_told_from_one_without_noise() -> None:
    noisy, exact = RangerMonitor(0.1), RangerMonitor(0.1)
    for k in range(NOISY_ECHOES + 1):
        noisy.process_echo(echo(1.0 + 0.001 * k, 100 * k), 100 * k * MS)
        exact.process_echo(echo(1.0, 100 * k), 100 * k * MS)
    last = 100 * NOISY_ECHOES
    for k in range(1, FROZEN_ECHOES + 1):
        for one in (noisy, exact):
            one.process_echo(echo(1.5, last + 100 * k), (last + 100 * k) * MS)
    now = (last + 100 * FROZEN_ECHOES) * MS
    assert noisy.fault(now) == "" and exact.fault(now) == ""
    noisy.process_echo(echo(1.5, last + 900), now)
    assert "frozen" in noisy.fault(now)
    noisy.process_echo(echo(math.inf, last + 900), now)
    assert noisy.fault(now) == "", "nothing in range repeats on a working ranger"


def test_late_and_future_echoes_are_named() -> None:
    ranger = RangerMonitor(0.1)
    ranger.process_echo(echo(1.0, 1000), 1400 * MS)
    assert "come late" in ranger.fault(1400 * MS) and "sent nothing" in ranger.fault(2000 * MS)
    ranger.process_echo(echo(1.0, 1600), 1400 * MS)
    assert "in the future" in ranger.fault(1400 * MS)


@pytest.mark.parametrize("lag", [0, 2, 6])
def test_the_latency_of_the_wheels_is_measured(lag: int) -> None:
    """Even seeds chose the window; here the speeds are those of an odd one."""
    rng, estimator = np.random.default_rng(7), LatencyEstimator(0.05, 0.35, 0.15)
    speeds = np.repeat(rng.uniform(-0.35, 0.35, 20), 10)
    speeds = np.convolve(speeds, np.ones(8) / 8, "same")
    speeds = np.concatenate([speeds, np.full(100, speeds[-1])])  # a constant speed shows no latency
    for k in range(lag, len(speeds)):
        estimator.process(float(speeds[k]), float(speeds[k - lag] + 0.005 * rng.standard_normal()))
    assert estimator.latency == pytest.approx(0.05 * lag, abs=0.02)
