"""Keyboard driving: the chapter's table of keys, as pure logic."""

from __future__ import annotations

from chefbot.robot.motion_limits import Limits

MOVES = {
    "i": (1, 0), "o": (1, -1), "u": (1, 1), "j": (0, 1), "l": (0, -1), ",": (-1, 0), ".": (-1, 1), "m": (-1,
    -1),
}  # fmt: skip
"""Key -> signs of (v, w); w counter-clockwise."""
SCALES = {
    "q": (1.1, 1.1),
    "z": (0.9, 0.9),
    "w": (1.1, 1.0),
    "x": (0.9, 1.0),
    "e": (1.0, 1.1),
    "c": (1.0, 0.9),
}
STOPS = (" ", "k")
DEAD_MAN = 0.5
"""Seconds without a key until the robot slows to a stop."""
RAMP_SPEED, RAMP_TURN = 0.2, 1.0
"""The chapter's 0.02 m/s and 0.1 rad/s in every tenth of a second."""
START = 0.5
"""Share of the robot's limits that a session begins with."""


class Teleop:
    """Keys to twists. `speed` and `turn` are what a move key asks for, never above the robot's limits."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.speed, self.turn = START * limits.speed, START * limits.turn
        self._v = self._w = 0.0
        self._target = (0.0, 0.0)
        self._silent = 0.0

    def update(self, key: str | None, dt: float) -> tuple[float, float]:
        """The twist after `dt` seconds in which `key` was pressed, or none."""
        self._silent = 0.0 if key is not None else self._silent + dt
        if key is not None:
            self._press(key)
        elif self._silent > DEAD_MAN:
            self._target = (0.0, 0.0)
        self._v = _towards(self._v, self._target[0], RAMP_SPEED * dt)
        self._w = _towards(self._w, self._target[1], RAMP_TURN * dt)
        part = self.limits.scale(self._v, self._w)
        return self._v * part, self._w * part

    def _press(self, key: str) -> None:
        if key in SCALES:
            more, tighter = SCALES[key]
            self.speed = min(self.speed * more, self.limits.speed)
            self.turn = min(self.turn * tighter, self.limits.turn)
        elif key in STOPS:
            self._v = self._w = 0.0
            self._target = (0.0, 0.0)
        else:
            forward, left = MOVES.get(key, (0, 0))
            self._target = (forward * self.speed, left * self.turn)


def _towards(now: float, target: float, step: float) -> float:
    return min(target, now + step) if target > now else max(target, now - step)
