"""Motion limits of a robot: the minimum of the owner's limits, motor capability and tyre grip."""

from __future__ import annotations

import math
from typing import NamedTuple

from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.spec import GRAVITY, ROLLING_RESISTANCE, Robot

STOP_GRIP_FRACTION = 0.7
"""Part of tyre grip that a stop uses unless the owner sets it: the rest is for ramps and wet floors."""
CONTACT_FORCE = 260.0
"""Maximum transient force on a person's lower leg, N: twice the quasi-static 130 N (ISO/TS 15066, table A.2)."""
LEG_STIFFNESS, PERSON_MASS = 60_000.0, 75.0
"""Effective spring constant of the lower leg, N/m, and mass of a person, kg (ISO/TS 15066, table A.3)."""


def rolling_torque(robot: Robot) -> float:
    """Return the torque of each wheel against rolling resistance on a hard floor, N m, of the loaded robot."""
    return ROLLING_RESISTANCE * total_mass(robot) * GRAVITY * robot.wheel_radius / 2.0


def no_load_wheel_speed(robot: Robot) -> float:
    """Return the speed of a wheel at the ground, m/s, at the motor's no-load speed."""
    return robot.motor.no_load_speed * robot.wheel_radius


def turn_rate_on_spot(robot: Robot, wheel_speed: float) -> float:
    """Return the turn rate on the spot, rad/s, with wheels at a speed at the ground, m/s, one forward, one back.

    An acceleration of the wheels, m/s^2, gives the angular acceleration, rad/s^2.
    """
    return 2.0 * wheel_speed / robot.wheels.separation


def max_wheel_speed(robot: Robot) -> float:
    """Return the maximum wheel speed at the ground, m/s, of the loaded robot on a hard floor.

    The motor's speed falls linearly with torque; the load is rolling resistance over drive efficiency.
    """
    # Share of the no-load speed that is left at this torque (linear motor characteristic).
    speed_fraction = 1.0 - rolling_torque(robot) / robot.wheel_stall_torque
    return no_load_wheel_speed(robot) * max(speed_fraction, 0.0)


def contact_speed(robot: Robot) -> float:
    """Return the speed, m/s, at which the loaded robot may touch a person's lower leg (ISO/TS 15066, annex A).

    v = F / sqrt(mu k) with the reduced mass mu of robot and person.
    """
    reduced_mass = 1.0 / (1.0 / PERSON_MASS + 1.0 / total_mass(robot))
    return CONTACT_FORCE / math.sqrt(reduced_mass * LEG_STIFFNESS)


def max_speed(robot: Robot) -> float:
    """Return the maximum forward speed, m/s.

    A robot that sees one plane only may meet what it does not see, and drives no faster than its contact speed.
    """
    speed = min(robot.drive.max_speed, max_wheel_speed(robot))
    return min(speed, contact_speed(robot)) if robot.sensors.sees_one_plane else speed


def one_plane_warning(robot: Robot) -> str:
    """Return a warning for a robot that sees one plane only, else an empty string."""
    if not robot.sensors.sees_one_plane:
        return ""
    return (
        "The lidar sees one plane only: no table tops, hanging boards, low boxes or drop-offs; "
        f"without a depth camera the robot drives at most {max_speed(robot):.2f} m/s."
    )


def max_turn(robot: Robot) -> float:
    """Return the maximum turn rate on the spot, rad/s."""
    return min(robot.drive.max_turn, turn_rate_on_spot(robot, max_wheel_speed(robot)))


def max_acceleration(robot: Robot) -> float:
    """Return the maximum forward acceleration, m/s^2, limited by tyre grip and motor torque."""
    return min(robot.drive.max_acceleration, _traction_limit(robot))


def _traction_limit(robot: Robot) -> float:
    """Return the acceleration that tyre grip and motor torque allow, m/s^2."""
    motor_limit = 2.0 * robot.wheel_stall_torque / (robot.wheel_radius * total_mass(robot))
    return min(robot.traction * GRAVITY, motor_limit)


def max_deceleration(robot: Robot) -> float:
    """Return the deceleration of a stop, m/s^2: the owner's, or a part of tyre grip, but no less than the
    maximum acceleration.

    A robot that passes its check does not tip over when it brakes as hard as its tyres grip.
    """
    braking = robot.drive.max_deceleration or STOP_GRIP_FRACTION * robot.traction * GRAVITY
    return max(min(braking, _traction_limit(robot)), max_acceleration(robot))


def max_turn_acceleration(robot: Robot) -> float:
    """Return the maximum angular acceleration on the spot, rad/s^2.

    The wheels accelerate no harder than when driving forward.
    """
    return min(robot.drive.max_turn_acceleration, turn_rate_on_spot(robot, max_acceleration(robot)))


def max_turn_deceleration(robot: Robot) -> float:
    """Return the angular deceleration of a stop, rad/s^2: harder than the acceleration by the same factor as
    forward."""
    return max_turn_acceleration(robot) * max_deceleration(robot) / max_acceleration(robot)


class Limits(NamedTuple):
    """Motion limits in metres, radians and seconds, all derived from the Robot."""

    speed: float
    angular_speed: float
    acceleration: float
    angular_acceleration: float
    deceleration: float
    angular_deceleration: float
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
            max_deceleration(robot),
            max_turn_deceleration(robot),
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
