"""From encoder counts to what each wheel rolled, and how well that is known."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.odometry.drive_model import Body
from chefbot.odometry.readings import WheelCounts, WheelTwist

STANDSTILL_NS = 250_000_000
"""Without a tick for so long the robot stands; a crawling one has steps without ticks too."""
STAMP_JITTER = 0.05
"""Seconds by which a step may have been longer than its stamps say."""
DEAD_NS = 200_000_000
"""A wheel without a tick for so long, while gyro and the other wheel say that it rolls, has no encoder."""
DEAD_TICKS = 20
"""So many the other one must have counted meanwhile."""


class Rolled(NamedTuple):
    """Travel of each rim since the last reading, m, their variances, and that of a slide, m^2.

    `shared` is the covariance of the two.
    """

    left: float
    right: float
    variance_left: float
    variance_right: float
    shared: float = 0.0
    slide: float = 0.0


class Counters(NamedTuple):
    """What is remembered of the two encoders."""

    counts: tuple[int, int] | None = None
    idle_ns: int = 0
    """Time without a tick from both."""
    silent_ns: tuple[int, int] = (0, 0)
    """Time without a tick from each."""
    alone: tuple[int, int] = (0, 0)
    """Ticks that the other wheel has counted in that time."""
    restarts: int = 0
    """Impossible jumps so far: the board restarted, or bytes were lost."""

    @property
    def standing(self) -> bool:
        """No tick for a while."""
        return self.idle_ns >= STANDSTILL_NS

    @property
    def silent_side(self) -> int | None:
        """0 if the left wheel has said nothing for too long while the other went on, 1 if the right one."""
        for side in (0, 1):
            if self.silent_ns[side] >= DEAD_NS and self.alone[side] >= DEAD_TICKS:
                return side
        return None


def tick_difference(new: int, old: int, bits: int) -> int:
    """Ticks from `old` to `new` of a counter that wraps after `bits` bits, the short way round."""
    half = 1 << (bits - 1)
    return (int(new) - int(old) + half) % (2 * half) - half


def count(body: Body, before: Counters, reading: WheelCounts, dt_ns: int) -> tuple[Counters, Rolled]:
    """The travel in the `dt_ns` since the last reading.

    The error of a wheel's travel has a variance proportional to the travel (Chong & Kleeman 1997, "Accurate
    odometry and error modelling for a mobile robot"), plus that of rounding. A standing wheel has none.
    """
    if before.counts is None:
        raise ValueError("the first counts have nothing to be compared with")
    pairs = zip((reading.left, reading.right), before.counts, strict=True)
    left, right = (tick_difference(new, old, body.counter_bits) for new, old in pairs)
    after = _heard(before, reading, (left, right), dt_ns)
    dt = dt_ns / 1e9
    if max(abs(left), abs(right)) * body.metres_per_tick > body.fastest_rim * (dt + STAMP_JITTER):
        return _lost(body, after, dt)
    rounding = 0.0 if after.standing else body.metres_per_tick**2 / 6.0
    travel = left * body.metres_per_tick, right * body.metres_per_tick
    variance = (body.slip**2 * abs(rim) + rounding for rim in travel)
    return after, Rolled(*travel, *variance)


def _heard(before: Counters, reading: WheelCounts, ticks: tuple[int, int], dt_ns: int) -> Counters:
    silent = [0 if t else s + dt_ns for t, s in zip(ticks, before.silent_ns, strict=True)]
    others = zip(ticks, reversed(ticks), before.alone, strict=True)
    alone = [0 if own else seen + abs(other) for own, other, seen in others]
    return before._replace(
        counts=(reading.left, reading.right),
        idle_ns=0 if any(ticks) else before.idle_ns + dt_ns,
        silent_ns=(silent[0], silent[1]),
        alone=(alone[0], alone[1]),
    )


def _lost(body: Body, after: Counters, dt: float) -> tuple[Counters, Rolled]:
    """Counts that no motion explains say nothing about this step."""
    return after._replace(restarts=after.restarts + 1), unknown(body, dt)


def unknown(body: Body, dt: float) -> Rolled:
    """What is known of `dt` seconds without wheels: no more than how fast they can turn."""
    variance = (body.fastest_rim * dt) ** 2
    return Rolled(0.0, 0.0, variance, variance)


def ambiguous(body: Body, rolled: Rolled, ticks_before: int, ticks: int) -> Rolled:
    """The same where one wheel is silent against all evidence, and it is open which of the two errs.

    If its encoder is dead the robot goes as far as the other wheel rolls, if that one spins it stays. The step
    is in the middle with half the travel as its deviation, which adds up along the way: from D to D + d the
    variance grows by ((D + d)^2 - D^2) / 4, for both rims alike.
    """
    before, after = ticks_before * body.metres_per_tick, (ticks_before + ticks) * body.metres_per_tick
    more = 0.25 * (after**2 - before**2)
    return rolled._replace(
        variance_left=rolled.variance_left + more,
        variance_right=rolled.variance_right + more,
        shared=rolled.shared + more,
    )


def of_twist(body: Body, reading: WheelTwist, dt: float) -> Rolled:
    """Rims that would move the base so: l, r = (v -/+ w b / 2) dt, with the covariance that follows."""
    half = 0.5 * body.separation
    forward, turning = reading.speed_variance * dt**2, reading.turn_variance * (half * dt) ** 2
    return Rolled(
        (reading.speed - reading.turn * half) * dt,
        (reading.speed + reading.turn * half) * dt,
        forward + turning,
        forward + turning,
        forward - turning,
        reading.slide_variance * dt**2,
    )
