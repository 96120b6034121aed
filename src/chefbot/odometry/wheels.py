"""From encoder counts to what each wheel rolled, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

from chefbot.odometry.params import OdometryParams
from chefbot.robot.spec import Robot

STANDSTILL_TIME = 0.25
"""Seconds without a tick after which the robot stands; a crawling one has steps without ticks too."""
SPEED_MARGIN = 1.5
"""Nobody turns a geared wheel faster than this many times its no-load speed."""
STAMP_JITTER = 0.05
"""Seconds by which a step may have been longer than its stamps say."""


@dataclass(frozen=True)
class WheelStep:
    """Travel of each rim since the last reading, m, and its variance, m^2."""

    left: float
    right: float
    variance_left: float
    variance_right: float


def tick_difference(new: int, old: int, bits: int) -> int:
    """Ticks from `old` to `new` of a counter that wraps after `bits` bits, the short way round."""
    half = 1 << (bits - 1)
    return (int(new) - int(old) + half) % (2 * half) - half


class Wheels:
    """Two encoders, their wrapping counters, and what their readings are worth.

    The error of a wheel's travel has a variance proportional to the travel (Chong & Kleeman 1997, "Accurate
    odometry and error modelling for a mobile robot"), plus that of rounding. A standing wheel has none.
    """

    def __init__(self, robot: Robot, params: OdometryParams, counter_bits: int) -> None:
        if not 2 <= counter_bits <= 64:
            raise ValueError(f"a counter of {counter_bits} bits is none")
        self._bits = counter_bits
        self._metres_per_tick = robot.metres_per_tick
        self._slip_variance = params.slip**2
        self._fastest = SPEED_MARGIN * robot.motor.no_load_speed * robot.wheel_radius
        self._last: tuple[int, int] | None = None
        self._idle = 0.0
        self.restarts = 0
        """Impossible jumps so far: the board restarted, or bytes were lost."""

    @property
    def started(self) -> bool:
        """Whether there was a reading to compare the next one with."""
        return self._last is not None

    @property
    def standing(self) -> bool:
        """No tick for a while."""
        return self._idle >= STANDSTILL_TIME

    def step(self, ticks_left: int, ticks_right: int, dt: float) -> WheelStep:
        """The travel in the `dt` seconds since the last call; the first call only notes the counts."""
        if not dt > 0.0:
            raise ValueError(f"a step of {dt} s is none")
        last, self._last = self._last, (ticks_left, ticks_right)
        if last is None:
            return WheelStep(0.0, 0.0, 0.0, 0.0)
        left = tick_difference(ticks_left, last[0], self._bits)
        right = tick_difference(ticks_right, last[1], self._bits)
        self._idle = self._idle + dt if left == 0 and right == 0 else 0.0
        if max(abs(left), abs(right)) * self._metres_per_tick > self._fastest * (dt + STAMP_JITTER):
            return self._lost(dt)
        return self._rolled(left * self._metres_per_tick, right * self._metres_per_tick)

    def _rolled(self, left: float, right: float) -> WheelStep:
        rounding = 0.0 if self.standing else self._metres_per_tick**2 / 6.0
        return WheelStep(
            left,
            right,
            self._slip_variance * abs(left) + rounding,
            self._slip_variance * abs(right) + rounding,
        )

    def _lost(self, dt: float) -> WheelStep:
        """Counts that no motion explains say nothing about this step."""
        self.restarts += 1
        variance = (self._fastest * dt) ** 2
        return WheelStep(0.0, 0.0, variance, variance)
