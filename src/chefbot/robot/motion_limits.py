"""Motion limits of a robot: the minimum of the owner's limits, motor capability and tyre grip."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.spec import DRIVE_EFFICIENCY, DRIVEN_WEIGHT_FRACTION, GRAVITY, ROLLING_RESISTANCE, Robot


def max_wheel_speed(robot: Robot) -> float:
    """Return the maximum wheel speed at the ground, m/s, of the loaded robot on a hard floor.

    The motor's speed falls linearly with torque; the load is rolling resistance over drive efficiency.
    """
    # Torque per wheel against rolling resistance: half the robot's weight on each motor.
    rolling_torque = ROLLING_RESISTANCE * total_mass(robot) * GRAVITY * robot.wheel_radius / 2.0
    # Share of the no-load speed that is left at this torque (linear motor characteristic).
    speed_fraction = 1.0 - rolling_torque / (DRIVE_EFFICIENCY * robot.motor.stall_torque)
    return robot.motor.no_load_speed * robot.wheel_radius * max(speed_fraction, 0.0)


def max_speed(robot: Robot) -> float:
    """Return the maximum forward speed, m/s."""
    return min(robot.drive.max_speed, max_wheel_speed(robot))


def max_turn(robot: Robot) -> float:
    """Return the maximum turn rate on the spot, rad/s."""
    return min(robot.drive.max_turn, 2.0 * max_wheel_speed(robot) / robot.wheels.separation)


def max_acceleration(robot: Robot) -> float:
    """Return the maximum forward acceleration, m/s^2, limited by tyre grip and motor torque."""
    grip_limit = robot.wheels.friction * GRAVITY * DRIVEN_WEIGHT_FRACTION
    motor_limit = 2.0 * DRIVE_EFFICIENCY * robot.motor.stall_torque / (robot.wheel_radius * total_mass(robot))
    return min(robot.drive.max_acceleration, grip_limit, motor_limit)


def max_turn_acceleration(robot: Robot) -> float:
    """Return the maximum angular acceleration on the spot, rad/s^2.

    The wheels accelerate no harder than when driving forward.
    """
    return min(robot.drive.max_turn_acceleration, 2.0 * max_acceleration(robot) / robot.wheels.separation)


class Limits(NamedTuple):
    """Motion limits in metres, radians and seconds, all derived from the Robot."""

    speed: float
    angular_speed: float
    acceleration: float
    angular_acceleration: float
    wheel_speed: float
    separation: float

    @staticmethod
    def of(robot: Robot) -> Limits:
        """Return the motion limits of a robot."""
        return Limits(
            max_speed(robot),
            max_turn(robot),
            max_acceleration(robot),
            max_turn_acceleration(robot),
            max_wheel_speed(robot),
            robot.wheels.separation,
        )

    def scale(self, v: float, w: float) -> float:
        """Return the largest factor up to 1 that scales a twist into all limits: speed, turn rate, wheel
        speed.

        v: forward speed, m/s. w: turn rate, rad/s.
        """
        # Speed of the outer wheel at the ground: |v| + |w| b / 2.
        outer_wheel_speed = abs(v) + abs(w) * self.separation / 2
        pairs = ((self.speed, abs(v)), (self.angular_speed, abs(w)), (self.wheel_speed, outer_wheel_speed))
        return min([1.0, *(limit / value for limit, value in pairs if value > limit)])
