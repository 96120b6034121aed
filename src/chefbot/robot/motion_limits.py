"""What a robot's base can do: never more than its owner allows, its motors give and its tyres hold."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.spec import DRIVE_EFFICIENCY, DRIVEN_SHARE_OF_WEIGHT, GRAVITY, ROLLING_RESISTANCE, Robot


def max_wheel_speed(robot: Robot) -> float:
    """Speed of the wheels at the ground, m/s, that both motors hold while the loaded robot rolls on a hard floor."""
    rolling = ROLLING_RESISTANCE * total_mass(robot) * GRAVITY * robot.wheel_radius / 2.0
    spare = 1.0 - rolling / (DRIVE_EFFICIENCY * robot.motor.stall_torque)
    return robot.motor.no_load_speed * robot.wheel_radius * max(spare, 0.0)


def max_speed(robot: Robot) -> float:
    """Forward speed, m/s."""
    return min(robot.drive.max_speed, max_wheel_speed(robot))


def max_turn(robot: Robot) -> float:
    """Turning rate on the spot, rad/s."""
    return min(robot.drive.max_turn, 2.0 * max_wheel_speed(robot) / robot.wheels.separation)


def max_acceleration(robot: Robot) -> float:
    """Forward, m/s^2."""
    grip = robot.wheels.friction * GRAVITY * DRIVEN_SHARE_OF_WEIGHT
    motors = 2.0 * DRIVE_EFFICIENCY * robot.motor.stall_torque / (robot.wheel_radius * total_mass(robot))
    return min(robot.drive.max_acceleration, grip, motors)


def max_turn_acceleration(robot: Robot) -> float:
    """On the spot, rad/s^2: the wheels accelerate no harder than they may forward."""
    return min(robot.drive.max_turn_acceleration, 2.0 * max_acceleration(robot) / robot.wheels.separation)


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
            max_speed(robot),
            max_turn(robot),
            max_acceleration(robot),
            max_turn_acceleration(robot),
            max_wheel_speed(robot),
            robot.wheels.separation,
        )

    def scale(self, v: float, w: float) -> float:
        """The largest factor up to 1 with which the twist keeps speed, turn and both rims within their
        limits."""
        rim = abs(v) + abs(w) * self.separation / 2
        pairs = ((self.speed, abs(v)), (self.turn, abs(w)), (self.wheel_speed, rim))
        return min([1.0, *(top / x for top, x in pairs if x > top)])
