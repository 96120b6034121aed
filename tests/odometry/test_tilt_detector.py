"""Tests that a robot that tips over is noticed, and nothing else taken for it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sensor_readings import BODY, simulate_readings, slalom_commands

from chefbot.maths.se2 import IDENTITY
from chefbot.odometry.diagnostics import WITHOUT_IMU, diagnostic_message
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.motion_model import PITCH, ROLL, YAW
from chefbot.odometry.readings import ImuReading, Triple, WheelCounts
from chefbot.odometry.sensor_health import Condition, Source
from chefbot.odometry.tilt_detector import (
    MAX_GAP_NS,
    MAX_TILT,
    UPRIGHT,
    TiltDetector,
    _angle,
    _towards,
    _turned,
    _unit,
)
from chefbot.robot.spec import GRAVITY

RATE = 100
STEP_NS = 10_000_000
MEASURED = (1e-6, 1e-6, 1e-6)
AXES: dict[str, Triple] = {"forward": (0.0, 1.0, 0.0), "right": (1.0, 0.0, 0.0), "oblique": (0.6, -0.8, 0.0)}


def up_at(angle: float, axis: Triple = AXES["forward"]) -> Triple:
    """Return the upward direction in the axes of a body that is turned by an angle about a level axis."""
    return -axis[1] * math.sin(angle), axis[0] * math.sin(angle), math.cos(angle)


class Body:
    """A robot with an IMU that is turned about a level axis: the readings of the detector under test."""

    def __init__(self, axis: str = "forward") -> None:
        self.detector, self.axis = TiltDetector(), AXES[axis]
        self.angle, self.stamp_ns, self.tipped_at, self.falls = 0.0, 0, -1.0, 0

    def send(self, rates: Triple, force: Triple, step_ns: int = STEP_NS) -> None:
        self.stamp_ns += step_ns
        if self.detector.process(ImuReading(self.stamp_ns, rates, MEASURED, force, MEASURED)):
            self.tipped_at = self.stamp_ns * 1e-9
            self.falls += 1

    def turn(
        self, degrees: float, seconds: float, felt: Callable[[Triple], Triple] = lambda force: force
    ) -> None:
        """Turn by an angle in a time; `felt` changes the specific force that is measured."""
        rate = math.radians(degrees) / seconds
        for _ in range(round(seconds * RATE)):
            self.angle += rate / RATE
            x, y, z = (GRAVITY * one for one in up_at(self.angle, self.axis))
            p, q, r = (rate * one for one in self.axis)
            self.send((p, q, r), felt((x, y, z)))

    def stand(self, seconds: float, felt: Callable[[Triple], Triple] = lambda force: force) -> None:
        self.turn(0.0, seconds, felt)

    @property
    def seconds(self) -> float:
        return self.stamp_ns * 1e-9


def upright_body(axis: str = "forward") -> Body:
    body = Body(axis)
    body.stand(1.5)
    return body


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("degrees", [30.0, -35.0, 90.0, -120.0, 180.0])
def test_a_fall_to_any_side_is_noticed_while_it_happens(axis: str, degrees: float) -> None:
    body = upright_body(axis)
    begin = body.seconds
    body.turn(degrees, abs(degrees) / 150.0)
    body.stand(0.3)
    assert begin < body.tipped_at < begin + 0.1 + 0.25 + abs(degrees) / 150.0
    assert body.detector.tilted and not body.detector.upright and body.falls == 1


def test_a_fall_with_impacts_is_noticed() -> None:
    body = upright_body()
    rng = np.random.default_rng(1)

    def shaken(force: Triple) -> Triple:
        x, y, z = (np.array(force) * rng.uniform(0.0, 2.0) + rng.normal(0.0, 5.0, 3)).tolist()
        return x, y, z

    body.turn(95.0, 0.5, shaken)
    body.stand(0.5, shaken)
    assert body.tipped_at > 0.0


@pytest.mark.parametrize(("degrees", "tips"), [(19.0, False), (-19.0, False), (21.0, True), (-21.0, True)])
def test_a_slow_tilt_counts_from_20_degrees(degrees: float, tips: bool) -> None:
    body = upright_body()
    body.turn(degrees, 4.0)
    body.stand(3.0)
    assert body.detector.tilted == tips
    assert math.degrees(MAX_TILT) == pytest.approx(20.0) and math.degrees(UPRIGHT) == pytest.approx(10.0)


def test_it_ends_a_second_after_the_robot_stands_upright() -> None:
    body = upright_body()
    body.turn(90.0, 0.6)
    body.stand(5.0)
    body.turn(-79.0, 1.0)
    body.stand(3.0)
    assert body.detector.tilted, "11 degrees are not upright"
    body.turn(-2.0, 0.1)
    body.stand(1.0)
    assert body.detector.tilted
    body.stand(0.2)
    assert not body.detector.tilted and body.detector.upright


def test_a_lift_and_a_shock_after_a_fall_do_not_end_it() -> None:
    body = upright_body()
    body.turn(90.0, 0.6)
    body.stand(0.5)
    for factor in (0.75, 1.25):
        body.stand(3.0, lambda _, factor=factor: (0.0, 0.0, factor * GRAVITY))
        assert body.detector.tilted, "an upward force, but not that of gravity"
    body.stand(2.0, lambda _: (0.0, 0.0, 1.15 * GRAVITY))
    assert not body.detector.tilted


@pytest.mark.parametrize("seconds", [0.05, 2.0, 30.0])
def test_a_push_without_a_rotation_is_no_fall(seconds: float) -> None:
    body = upright_body()
    body.stand(seconds, lambda force: (-force[2], force[1], force[2]))
    assert body.tipped_at < 0.0


def test_a_sensor_that_is_mounted_otherwise_is_no_fall() -> None:
    """And as nothing is known then, neither is a slow drift of the gyro."""
    body = upright_body()
    for _ in range(60 * RATE):
        body.send((0.02, 0.0, 0.0), (0.0, 0.0, -GRAVITY))
    assert body.tipped_at < 0.0
    body.stand(2.0)
    body.turn(60.0, 0.5)
    body.stand(0.2)
    assert body.detector.tilted, "judged again once it was upright"


def test_a_gyro_offset_is_no_fall() -> None:
    body = upright_body()
    for _ in range(30 * RATE):
        body.send((0.5, -0.8, 0.3), (0.0, 0.0, GRAVITY))
    assert body.tipped_at < 0.0 and body.detector.upright


def test_a_robot_that_starts_on_its_side_is_not_judged() -> None:
    body = Body()
    assert not body.detector.tilted and not body.detector.upright
    body.turn(60.0, 0.4)
    assert not body.detector.tilted, "nobody knows yet that it was upright"
    body.angle = 1.5
    body.stand(5.0)
    assert not body.detector.tilted and not body.detector.upright


@pytest.mark.parametrize(
    ("gap_ns", "known"), [(MAX_GAP_NS, True), (MAX_GAP_NS + 1, False), (-MAX_GAP_NS - 1, False)]
)
def test_after_a_gap_it_begins_again(gap_ns: int, known: bool) -> None:
    body = upright_body()
    up = body.detector._up
    body.send((0.0, 0.0 if known else 9.0, 0.0), (0.0, 0.0, GRAVITY), gap_ns)
    assert body.detector.upright == known and body.detector._up == pytest.approx(up, abs=1e-9)
    body.turn(60.0, 0.4)
    body.stand(0.2)
    assert body.detector.tilted == known


def test_late_and_infinite_readings_are_left_out() -> None:
    body = upright_body()
    stamp, lying = body.stamp_ns, (-GRAVITY, 0.0, 0.0)
    for late_ns in (0, 50_000_000, MAX_GAP_NS):
        late = ImuReading(stamp - late_ns, (0.0, 9.0, 0.0), MEASURED, lying, MEASURED)
        assert [body.detector.process(late) for _ in range(50)] == [False] * 50
    for bad in (math.nan, math.inf):
        body.send((bad, 0.0, 0.0), (0.0, 0.0, GRAVITY))
        body.send((0.0, 0.0, 0.0), (0.0, bad, GRAVITY))
    assert body.detector.upright
    body.turn(60.0, 0.4)
    body.stand(0.2)
    assert body.detector.tilted


@pytest.mark.parametrize("unmeasured", range(3))
def test_axes_that_are_not_measured_are_not_used(unmeasured: int) -> None:
    """Rates about x and y count together, without z, and the force with all axes only."""
    body = upright_body()
    before = body.detector._up, body.detector._force
    a, b, c = (math.inf if axis == unmeasured else 1e-6 for axis in range(3))
    body.stamp_ns += STEP_NS
    body.detector.process(ImuReading(body.stamp_ns, (3.0, 3.0, 0.0), (a, b, c), (9.0, 0.0, 0.0), (a, b, c)))
    assert (body.detector._up == before[0]) == (unmeasured < 2) and body.detector._force == before[1]
    body.stamp_ns += STEP_NS
    body.detector.process(ImuReading(body.stamp_ns, (0.0, 0.0, 0.0), MEASURED, (9.0, 0.0, 0.0), MEASURED))
    assert body.detector._force != before[1]


@given(st.integers(0, 2**31), st.sampled_from([0.5, 2.0, 6.0]))
def test_shaking_and_driving_is_no_fall(seed: int, shake: float) -> None:
    """Slopes up to 12 degrees, and the vibration of wheels and floor."""
    rng, body = np.random.default_rng(seed), upright_body()

    def shaken(force: Triple) -> Triple:
        x, y, z = (np.array(force) + rng.normal(0.0, shake, 3)).tolist()
        return x, y, z

    for slope in rng.uniform(-12.0, 12.0, 5).tolist():
        body.turn(slope - math.degrees(body.angle), 1.0, shaken)
    assert body.tipped_at < 0.0


def test_the_second_in_which_it_is_upright_is_exact() -> None:
    body = Body()
    body.stand(1.0)
    assert not body.detector.upright
    body.stand(0.01)
    assert body.detector.upright


@pytest.mark.parametrize(("degrees", "upright"), [(9.9, True), (10.1, False)])
def test_upright_is_up_to_ten_degrees(degrees: float, upright: bool) -> None:
    body = Body()
    body.angle = math.radians(degrees)
    body.stand(2.0)
    assert body.detector.upright == upright


def test_the_direction_follows_the_rotation() -> None:
    """Of a body that tilts by 15 degrees, and then turns about its own upward axis."""
    body = upright_body()
    body.turn(15.0, 1.0)
    for axis in range(3):
        rates, angle = [0.0, 0.0, 0.0], 0.02 * (axis + 1)
        rates[axis] = angle / 0.1
        before = np.array(body.detector._up)
        for _ in range(10):
            free_fall = ImuReading(body.stamp_ns + STEP_NS, (rates[0], rates[1], rates[2]), MEASURED)
            body.stamp_ns += STEP_NS
            body.detector.process(free_fall)
        turned = before - np.cross(np.eye(3)[axis], before) * angle
        assert body.detector._up == pytest.approx(turned.tolist(), abs=2e-3)


def test_the_accelerometer_corrects_within_two_seconds() -> None:
    body = upright_body()
    aslant = tuple(GRAVITY * one for one in up_at(math.radians(15.0)))
    body.stand(1.0, lambda _: aslant)  # the smoothed force has settled
    angles = []
    for _ in range(2):
        x, _, z = body.detector._up
        angles.append(math.radians(15.0) - math.atan2(-x, z))
        body.stand(2.0, lambda _: aslant)
    assert angles[1] == pytest.approx(angles[0] * math.exp(-1.0), rel=0.05)
    body.stand(2.0, lambda force: (3.0 * force[0], 0.0, 3.0 * force[2]))
    x, _, z = body.detector._up
    assert math.atan2(-x, z) > math.radians(11.0), "what is not gravity corrects nothing"


@pytest.mark.parametrize(("seconds", "known"), [(0.9, True), (2.5, False)])
def test_a_contradiction_of_a_second_ends_the_knowledge(seconds: float, known: bool) -> None:
    body = upright_body()
    body.stand(seconds, lambda _: (-9.66, 0.0, 1.7))
    body.turn(60.0, 0.4, lambda _: (-9.66, 0.0, 1.7))
    assert body.detector.tilted == known


def test_vectors() -> None:
    assert _unit((0.0, 0.0, 0.0)) == (0.0, 0.0, 1.0) and _unit((3.0, 0.0, 4.0)) == (0.6, 0.0, 0.8)
    assert _towards((1.0, 0.0, -2.0), (3.0, 4.0, 2.0), 0.5) == (2.0, 2.0, 0.0)
    assert _towards((1.0, 0.0, 0.0), (3.0, 4.0, 2.0), 1.5) == (3.0, 4.0, 2.0)
    assert _angle((0.0, 0.0, 1.0), (0.0, 0.0, 1.0 + 1e-12)) == 0.0
    assert _angle((0.0, 0.0, 1.0), (0.0, 0.0, -1.0 - 1e-12)) == math.pi
    up, rates = (0.1, -0.2, 0.9), (0.3, 0.5, -0.7)
    expected = np.array(up) - 0.1 * np.cross(rates, up)
    assert _turned(up, rates, 0.1) == pytest.approx(expected.tolist())


# -- the filter that such a robot has


class Fall:
    """A robot with its wheels at rest that tips over forward and is set upright: the readings of its filter."""

    def __init__(self, ekf: Ekf, wheels: WheelCounts) -> None:
        self.ekf, self.wheels, self.stamp_ns, self.angle = ekf, wheels, wheels.stamp_ns, 0.0

    def turn(self, degrees: float, seconds: float) -> None:
        rate = math.radians(degrees) / seconds
        for i in range(round(seconds * RATE)):
            self.angle += rate / RATE
            self.stamp_ns += STEP_NS
            x, y, z = (GRAVITY * one for one in up_at(self.angle))
            self.ekf.add(ImuReading(self.stamp_ns, (0.0, rate, 0.0), MEASURED, (x, y, z), (1e-3,) * 3))
            if i % 2:
                self.ekf.add(self.wheels._replace(stamp_ns=self.stamp_ns))


@pytest.mark.parametrize("degrees", [90.0, -95.0, 170.0])
def test_odometry_goes_on_after_a_fall(degrees: float) -> None:
    readings, _ = simulate_readings(slalom_commands(8.0))
    ekf = Ekf(BODY)
    for reading in readings:
        ekf.add(reading)
    before, last = ekf.estimate, readings[-1]
    assert isinstance(last, WheelCounts)
    fall = Fall(ekf, last)
    fall.turn(degrees, 0.7)
    fall.turn(0.0, 4.0)
    assert ekf.tilted and diagnostic_message(ekf, fall.stamp_ns) == WITHOUT_IMU
    fall.turn(-degrees, 1.0)
    fall.turn(0.0, 1.5)
    after, end = ekf.estimate, fall.stamp_ns
    assert not ekf.tilted and ekf.condition(Source.GYRO, end) is Condition.FRESH
    assert np.abs(ekf.belief.state[[ROLL, PITCH]]).max() < math.radians(5.0)
    assert after.pose.distance(before.pose) < 0.1
    assert math.sqrt(after.covariance[2, 2]) > 1.5 and math.sqrt(after.covariance[0, 0]) >= 1.0
    # From there a straight metre is a straight metre
    ticks = round(0.01 / BODY.metres_per_tick)
    for i in range(1, 101):
        stamp = end + i * 2 * STEP_NS
        ekf.add(ImuReading(stamp, (0.0, 0.0, 0.0), MEASURED, (0.0, 0.0, GRAVITY), (1e-3,) * 3))
        ekf.add(WheelCounts(stamp, last.left + i * ticks, last.right + i * ticks))
    step = after.pose.between(ekf.estimate.pose)
    assert step.x == pytest.approx(100 * ticks * BODY.metres_per_tick, rel=0.02)
    assert abs(step.y) < 0.05 and abs(step.yaw) < 0.05


def test_an_attitude_that_no_robot_has_is_left() -> None:
    """It starts on its side, so that nobody knows that it fell; near 90 degrees the angles would be singular."""
    ekf = Ekf(BODY, IDENTITY)
    for i in range(1, 40 * RATE):
        ekf.add(ImuReading(i * STEP_NS, (0.0, 0.0, 0.0), MEASURED, (-GRAVITY, 0.0, 0.0), (1e-3,) * 3))
        ekf.add(WheelCounts(i * STEP_NS, 0, 0))
        assert np.abs(ekf.belief.state[[ROLL, PITCH]]).max() < math.radians(61.0)
    assert math.isfinite(ekf.belief.state[YAW]) and ekf.estimate.pose.distance(IDENTITY) < 0.1
