"""The speed of one wheel: feed-forward from the motor's data, PI on what the encoder says."""

from __future__ import annotations

import math
from collections import deque

from chefbot.robot.spec import Robot

WINDOW = 5
"""Encoder readings that a speed is taken over; at 100 Hz a slow wheel gives few ticks in one."""
RESET_TIME = 0.15
"""Seconds in which the integral repeats the proportional part (Astrom & Hagglund 1995, 3.2), about the
motor's lag."""


class WheelPid:
    """Duty in [-1, 1] for a wanted wheel speed; call at a steady rate, about 100 Hz.

    The feed-forward is the linear motor without load; the integral finds what load and friction add. It
    stands still while the output saturates (anti-windup) and is forgotten at rest, so that a stopped wheel
    gets no current.
    """

    def __init__(self, robot: Robot) -> None:
        self._gain = 1.0 / robot.motor.no_load_speed
        self._radians_per_tick = 2.0 * math.pi / robot.motor.ticks_per_turn
        self._readings: deque[tuple[int, float]] = deque(maxlen=WINDOW)
        self._integral = 0.0
        self.speed = 0.0

    def update(self, target: float, ticks: int, dt: float) -> float:
        """Duty for a wheel speed `target` (rad/s), after `ticks` encoder ticks in the last `dt` seconds (>
        0)."""
        self._readings.append((ticks, dt))
        self.speed = (
            self._radians_per_tick * sum(n for n, _ in self._readings) / sum(t for _, t in self._readings)
        )
        if target == 0.0 and not any(n for n, _ in self._readings):
            self._integral = 0.0
            return 0.0
        error = target - self.speed
        wanted = self._gain * (target + error) + self._integral
        step = self._gain * error * dt / RESET_TIME
        if abs(wanted) < 1.0 or wanted * step < 0.0:
            self._integral = max(-1.0, min(1.0, self._integral + step))
        return max(-1.0, min(1.0, wanted))

    def reset(self) -> None:
        """After a pause: nothing known of the wheel."""
        self._readings.clear()
        self._integral = self.speed = 0.0
