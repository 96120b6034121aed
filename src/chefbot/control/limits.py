"""What the base can do, as the controllers need it."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.robot.spec import Robot


class Limits(NamedTuple):
    """Metres, radians, seconds; all derived from the Robot."""

    speed: float
    turn: float
    acceleration: float
    turn_acceleration: float
    wheel_speed: float
    separation: float

    @staticmethod
    def of(robot: Robot) -> Limits:
        """The limits of a robot."""
        return Limits(
            robot.max_speed,
            robot.max_turn,
            robot.max_acceleration,
            robot.max_turn_acceleration,
            robot.max_wheel_speed,
            robot.wheels.separation,
        )

    def scale(self, v: float, w: float) -> float:
        """The largest factor up to 1 with which the twist keeps speed, turn and both rims within their
        limits."""
        rim = abs(v) + abs(w) * self.separation / 2
        pairs = ((self.speed, abs(v)), (self.turn, abs(w)), (self.wheel_speed, rim))
        return min([1.0, *(top / x for top, x in pairs if x > top)])
