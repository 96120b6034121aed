"""Speed control of one wheel: feed-forward from the motor's data and PI control on the encoder's speed."""

from __future__ import annotations

from collections import deque

from chefbot.robot.spec import Robot

WINDOW = 5
"""Encoder readings that a speed is averaged over; at 100 Hz a slow wheel gives few ticks in one."""
RESET_TIME = 0.15
"""Reset time of the integral, s, in which it repeats the proportional part (Astrom & Hagglund 1995, 3.2);
about the motor's time constant."""


class WheelPid:
    """Calculates a duty cycle in [-1, 1] for a requested wheel speed; call it at a constant rate, about 100
    Hz.

    The feed-forward is the linear motor model without load; the integral compensates for load and friction.
    It is held while the output saturates (anti-windup) and reset at rest, so that a stopped wheel gets no
    current.
    """

    def __init__(self, robot: Robot) -> None:
        self._gain = 1.0 / robot.motor.no_load_speed
        self._radians_per_tick = 1.0 / robot.motor.ticks_per_radian
        self._readings: deque[tuple[int, float]] = deque(maxlen=WINDOW)
        self._integral = 0.0
        self.speed = 0.0

    def update(self, target: float, ticks: int, dt: float) -> float:
        """Return the duty cycle for a wheel speed `target` (rad/s), after `ticks` encoder ticks in the last
        `dt` seconds (> 0)."""
        # Wheel speed: ticks over time in a sliding window.
        self._readings.append((ticks, dt))
        self.speed = (
            self._radians_per_tick * sum(n for n, _ in self._readings) / sum(t for _, t in self._readings)
        )
        # At rest: no current and no integral.
        if target == 0.0 and not any(n for n, _ in self._readings):
            self._integral = 0.0
            return 0.0
        # Feed-forward plus PI: u = k * (r + e) + I, with k = 1 / no-load speed.
        error = target - self.speed
        output = self._gain * (target + error) + self._integral
        # Anti-windup: integrate only if not saturated or if it leaves the saturation.
        step = self._gain * error * dt / RESET_TIME
        if abs(output) < 1.0 or output * step < 0.0:
            self._integral = max(-1.0, min(1.0, self._integral + step))
        return max(-1.0, min(1.0, output))

    def reset(self) -> None:
        """Reset the speed estimate and the integral after a pause."""
        self._readings.clear()
        self._integral = self.speed = 0.0
