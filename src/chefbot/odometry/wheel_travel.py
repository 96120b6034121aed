"""Wheel travel with its covariance from encoder counts."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.errors import OdometryError
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.readings import WheelCounts, WheelTwist

STANDSTILL_NS = 250_000_000
"""Time without a tick after which the robot counts as standing, ns; a slow robot has steps without ticks
too."""
STAMP_JITTER = 0.05
"""Time by which a step may have been longer than the difference of its stamps, s."""
DEAD_ENCODER_NS = 200_000_000
"""Time without a tick, while gyro and the other wheel measure motion, after which an encoder counts as dead,
ns."""
DEAD_ENCODER_TICKS = 20
"""Minimum number of ticks of the other wheel in that time."""


class WheelTravel(NamedTuple):
    """Travel of each wheel at the ground since the last reading, m, their variances, and that of a slide,
    m^2.

    `shared` is the covariance of the left and right travel.
    """

    left: float
    right: float
    left_variance: float
    right_variance: float
    shared: float = 0.0
    slide: float = 0.0


class EncoderState(NamedTuple):
    """The state of the two encoder counters."""

    counts: tuple[int, int] | None = None
    idle_ns: int = 0
    """Time without a tick of either encoder, ns."""
    tickless_ns: tuple[int, int] = (0, 0)
    """Time without a tick of the left and right encoder, ns."""
    other_wheel_ticks: tuple[int, int] = (0, 0)
    """Ticks of the other wheel in that time."""
    restarts: int = 0
    """Number of impossible jumps: the board restarted, or bytes were lost."""

    @property
    def standing(self) -> bool:
        """Whether neither encoder has ticked for `STANDSTILL_NS`."""
        return self.idle_ns >= STANDSTILL_NS

    @property
    def dead_encoder_side(self) -> int | None:
        """Index of an encoder without ticks while the other one counts: 0 left, 1 right, None if both
        work."""
        for side in (0, 1):
            if (
                self.tickless_ns[side] >= DEAD_ENCODER_NS
                and self.other_wheel_ticks[side] >= DEAD_ENCODER_TICKS
            ):
                return side
        return None


def tick_difference(new: int, old: int, bits: int) -> int:
    """Return the ticks from `old` to `new` of a counter of `bits` bits, with wraparound resolved the short
    way."""
    half = 1 << (bits - 1)
    return (int(new) - int(old) + half) % (2 * half) - half


def travel_from_counts(
    body: DriveModel, before: EncoderState, reading: WheelCounts, dt_ns: int
) -> tuple[EncoderState, WheelTravel]:
    """Return the updated counters and the wheel travel in the `dt_ns` since the last reading.

    The variance of a wheel's travel is proportional to the travel (Chong & Kleeman 1997, "Accurate odometry
    and error modelling for a mobile robot"), plus that of rounding; at standstill there is no rounding error.
    """
    if before.counts is None:
        raise OdometryError("the first counts have no earlier counts to subtract")
    left = tick_difference(reading.left, before.counts[0], body.counter_bits)
    right = tick_difference(reading.right, before.counts[1], body.counter_bits)
    after = _updated_counters(before, reading, (left, right), dt_ns)
    dt = dt_ns / 1e9
    # Faster than the motor can turn: the counts are invalid
    if max(abs(left), abs(right)) * body.metres_per_tick > body.max_wheel_speed * (dt + STAMP_JITTER):
        return _invalid_step(body, after, dt)
    # Variance: slip^2 |d| plus the quantisation of two counts, 2 * tick^2 / 12
    rounding = 0.0 if after.standing else body.metres_per_tick**2 / 6.0
    travel, slip = (left * body.metres_per_tick, right * body.metres_per_tick), body.slip**2
    variance = slip * abs(travel[0]) + rounding, slip * abs(travel[1]) + rounding
    return after, WheelTravel(*travel, *variance)


def _updated_counters(
    before: EncoderState, reading: WheelCounts, ticks: tuple[int, int], dt_ns: int
) -> EncoderState:
    left, right = ticks
    tickless, alone = before.tickless_ns, before.other_wheel_ticks
    return EncoderState(
        (reading.left, reading.right),
        0 if left or right else before.idle_ns + dt_ns,
        (0 if left else tickless[0] + dt_ns, 0 if right else tickless[1] + dt_ns),
        (0 if left else alone[0] + abs(right), 0 if right else alone[1] + abs(left)),
        before.restarts,
    )


def _invalid_step(body: DriveModel, after: EncoderState, dt: float) -> tuple[EncoderState, WheelTravel]:
    """Count a restart and return a travel without information for this step."""
    return after._replace(restarts=after.restarts + 1), unknown_travel(body, dt)


def unknown_travel(body: DriveModel, dt: float) -> WheelTravel:
    """Return the travel in `dt` seconds without wheel readings: zero, bounded only by the maximum wheel
    speed."""
    variance = (body.max_wheel_speed * dt) ** 2
    return WheelTravel(0.0, 0.0, variance, variance)


def with_encoder_ambiguity(
    body: DriveModel, rolled: WheelTravel, ticks_before: int, ticks: int
) -> WheelTravel:
    """Return the travel with the uncertainty of a wheel that may have a dead encoder.

    If the encoder is dead the robot moves as far as the other wheel rolls; if the other wheel spins it stays.
    The mean is the middle, with half the travel as standard deviation, fully correlated along the path: from D
    to D + d the variance grows by ((D + d)^2 - D^2) / 4, for both wheels alike.
    """
    before, after = ticks_before * body.metres_per_tick, (ticks_before + ticks) * body.metres_per_tick
    added = 0.25 * (after**2 - before**2)
    return rolled._replace(
        left_variance=rolled.left_variance + added,
        right_variance=rolled.right_variance + added,
        shared=rolled.shared + added,
    )


def travel_from_twist(body: DriveModel, reading: WheelTwist, dt: float) -> WheelTravel:
    """Return the wheel travel of a twist, l, r = (v -/+ w b / 2) dt, with the covariance that follows."""
    # Var(l) = Var(r) = var_v dt^2 + var_w (b dt / 2)^2, Cov(l, r) = var_v dt^2 - var_w (b dt / 2)^2
    half_separation = 0.5 * body.separation
    forward, turning = reading.speed_variance * dt**2, reading.turn_variance * (half_separation * dt) ** 2
    return WheelTravel(
        (reading.speed - reading.turn * half_separation) * dt,
        (reading.speed + reading.turn * half_separation) * dt,
        forward + turning,
        forward + turning,
        forward - turning,
        reading.slide_variance * dt**2,
    )
