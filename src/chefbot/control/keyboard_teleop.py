"""Keyboard teleoperation with the key table of the chapter, as pure logic."""

from __future__ import annotations

from chefbot.robot.motion_limits import Limits

MOVES = {
    "i": (1, 0), "o": (1, -1), "u": (1, 1), "j": (0, 1), "l": (0, -1), ",": (-1, 0), ".": (-1, 1), "m": (-1,
    -1),
}  # fmt: skip
"""Signs of (v, w) by key; w counter-clockwise."""
SCALES = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
STOPS = (" ", "k")
DEAD_MAN_TIMEOUT = 0.5
"""Time without a key after which the robot slows to a stop, s."""
RAMP_SPEED, RAMP_TURN = 0.2, 1.0
"""Acceleration limits, m/s^2 and rad/s^2: the chapter's 0.02 m/s and 0.1 rad/s every 0.1 s."""
START = 0.5
"""Initial fraction of the robot's speed limits."""


class KeyboardTeleop:
    """Converts keys to twists; a move key requests `speed` and `turn`, which never exceed the robot's limits."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.speed, self.turn = START * limits.speed, START * limits.angular_speed
        self._v = self._w = 0.0
        self._target = (0.0, 0.0)
        self._silent = 0.0

    def update(self, key: str | None, dt: float) -> tuple[float, float]:
        """Return the ramped twist (v, w) after `dt` seconds in which `key`, or no key, was pressed."""
        self._silent = 0.0 if key is not None else self._silent + dt
        if key is not None:
            self._press(key)
        elif self._silent > DEAD_MAN_TIMEOUT:
            self._target = (0.0, 0.0)
        # ramp towards the target, then scale v and w together into the wheel speed limit
        self._v = _ramp(self._v, self._target[0], RAMP_SPEED * dt)
        self._w = _ramp(self._w, self._target[1], RAMP_TURN * dt)
        scale = self.limits.scale(self._v, self._w)
        return self._v * scale, self._w * scale

    def _press(self, key: str) -> None:
        if key in SCALES:
            linear_scale, angular_scale = SCALES[key]
            self.speed = min(self.speed * linear_scale, self.limits.speed)
            self.turn = min(self.turn * angular_scale, self.limits.angular_speed)
        elif key in STOPS:
            self._v = self._w = 0.0
            self._target = (0.0, 0.0)
        else:
            forward, left = MOVES.get(key, (0, 0))
            self._target = (forward * self.speed, left * self.turn)


def _ramp(value: float, target: float, step: float) -> float:
    return min(target, value + step) if target > value else max(target, value - step)
