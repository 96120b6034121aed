"""What the base may do while a sensor or the motor board fails: stop, creep by an operator, drive slowly."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from chefbot.maths.se2 import SE2
from chefbot.robot.spec import Robot
from chefbot.safety.command_multiplexer import CommandSource, StampedCommand
from chefbot.safety.known_obstacles import KnownObstacles
from chefbot.safety.monitor_polygons import CREEP_SPEED
from chefbot.safety.obstacle_sensors import ObstacleSensors
from chefbot.safety.ranger_freshness import TITLE, RangerMonitor
from chefbot.safety.sensor_freshness import CLOCK_TOLERANCE_NS

ODOMETRY_TIMEOUT_NS = 300_000_000
"""Maximum age of the pose in odom, ns."""


class Restriction(Enum):
    """How far faults of sensors and of the motor board restrict the motion."""

    NONE = "none"
    SLOW = "slow"
    NO_FORWARD = "not forward"
    STOP_UNLESS_TELEOP = "stop unless teleop"
    """Stop; an operator may creep once he has let go of the stick."""
    STOP = "stop"
    """Stop, regardless of who commands: the motors are off."""


class SensorVerdict(NamedTuple):
    """The restriction by faults of sensors or of the motor board, and the fault in words, empty for none.

    others: restrictions by further faults, which hold as well.
    """

    restriction: Restriction
    fault: str = ""
    others: tuple[Restriction, ...] = ()

    @property
    def stop_reason(self) -> str:
        """The fault for which the robot has to stop, empty if it does not."""
        return self.fault if self.requires_stop else ""

    @property
    def requires_stop(self) -> bool:
        """Whether the robot has to stop, unless an operator makes it creep."""
        return self.restriction in (Restriction.STOP_UNLESS_TELEOP, Restriction.STOP)

    def with_board_fault(self, fault: str) -> SensorVerdict:
        """Return the verdict with the motor board's fault, empty for none; its motors are off, so it comes first."""
        return SensorVerdict(Restriction.STOP, fault) if fault else self


class SensorPolicy:
    """Judges all sensors that the collision monitor needs: lidar, depth camera, ultrasonic ranger, and the odometry.

    optional: names of sensors that need not be connected.
    """

    def __init__(self, robot: Robot, optional: tuple[str, ...]) -> None:
        sensors = robot.sensors
        self.obstacle_sensors = ObstacleSensors(robot, optional)
        ranger = sensors.ultrasonic
        self.ranger = RangerMonitor(1.0 / ranger.rate) if ranger is not None else None
        self._ranger_optional = TITLE in optional
        self._sees = sensors.lidar is not None or sensors.depth_camera is not None

    def judge(
        self, now_ns: int, pose: SE2 | None, pose_ns: int | None, known: KnownObstacles
    ) -> SensorVerdict:
        """Return the restriction at a time; pose, pose_ns: newest one in odom with its stamp, if it has one."""
        fault = self.obstacle_sensors.fault(now_ns, pose, known)
        if self._sees and self._counts:
            fault = fault or odometry_fault(now_ns, pose, pose_ns)
        blind = self.obstacle_sensors.blind_ahead(known) if pose is not None or not fault else ""
        slow = self._ranger_fault(now_ns)
        found = (
            (Restriction.STOP_UNLESS_TELEOP, fault),
            (Restriction.NO_FORWARD, blind),
            (Restriction.SLOW, slow),
        )
        restrictions = [(restriction, text) for restriction, text in found if text]
        if not restrictions:
            return SensorVerdict(Restriction.NONE)
        (restriction, text), *others = restrictions
        return SensorVerdict(restriction, text, tuple(other for other, _ in others))

    @property
    def _counts(self) -> bool:
        """Whether any sensor is connected, or has to be, so that obstacles are to be placed."""
        return self.obstacle_sensors.any_counted

    def _ranger_fault(self, now_ns: int) -> str:
        ranger = self.ranger
        if ranger is None or (self._ranger_optional and not ranger.has_sent):
            return ""
        return ranger.fault(now_ns)


def odometry_fault(now_ns: int, pose: SE2 | None, pose_ns: int | None) -> str:
    """Return why obstacles cannot be placed by the odometry, or an empty string; a fixed transform has no stamp."""
    if pose is None:
        return "There is no odometry yet: no transform leads from base_link to odom."
    if pose_ns is None:
        return ""
    if now_ns - pose_ns > ODOMETRY_TIMEOUT_NS:
        return f"The odometry is late: the newest pose is {(now_ns - pose_ns) / 1e9:.1f} s old."
    if pose_ns - now_ns > CLOCK_TOLERANCE_NS:
        return "The odometry is stamped in the future: compare its computer's clock with this one's."
    return ""


def restricted(command: StampedCommand, verdict: SensorVerdict, radius: float, slow_speed: float) -> float:
    """Return the fraction of a command that all restrictions leave, so that a further fault never allows more.

    radius: of the circle around the body, m. slow_speed: m/s.
    """
    restrictions = (verdict.restriction, *verdict.others)
    return min(_fraction(command, restriction, radius, slow_speed) for restriction in restrictions)


def _fraction(command: StampedCommand, restriction: Restriction, radius: float, slow_speed: float) -> float:
    speed = abs(command.v) + abs(command.w) * radius
    if speed == 0.0 or restriction is Restriction.NONE:
        return 1.0
    if restriction is Restriction.STOP:
        return 0.0
    if restriction is Restriction.NO_FORWARD:
        return 1.0 if command.v <= 0.0 else 0.0
    if restriction is Restriction.SLOW:
        return min(1.0, slow_speed / abs(command.v)) if command.v else 1.0
    if restriction is Restriction.STOP_UNLESS_TELEOP and command.source is not CommandSource.TELEOP:
        return 0.0
    return min(1.0, CREEP_SPEED / speed)
