"""Dead reckoning from wheel encoders alone."""

from __future__ import annotations

from chefbot.errors import OdometryError
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.estimate import MotionEstimate, estimate_of
from chefbot.odometry.filter_state import FilterState
from chefbot.odometry.fusion import process_reading
from chefbot.odometry.motion_model import YAW, X, Y
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import Reading, WheelCounts
from chefbot.robot.spec import Robot


class DeadReckoning:
    """Wheel odometry whose covariance grows with distance and rotation and never shrinks.

    It is the EKF without its other sensors, updated at every step of the caller's loop. The covariance is of
    first order: once the heading is uncertain by more than about 5 degrees (5 m with wheels of 0.3 % error),
    the true positions form a banana-shaped distribution that the ellipse no longer covers.

    counter_bits: width of the board's counters, which may wrap around.
    """

    def __init__(
        self,
        robot: Robot,
        params: OdometryParams | None = None,
        counter_bits: int = 64,
        start: SE2 = IDENTITY,
    ) -> None:
        self._body = DriveModel.of(robot, params or OdometryParams(), counter_bits)
        self.belief = FilterState.initial(self._body)
        self.belief.state[[X, Y, YAW]] = start
        self._now_ns = 0

    def update(self, ticks_left: int, ticks_right: int, dt: float) -> MotionEstimate:
        """Update the estimate with the board's counts, read `dt` > 0 seconds after those of the last call."""
        return self._process(WheelCounts(self._advance_clock(dt), ticks_left, ticks_right))

    def _advance_clock(self, dt: float) -> int:
        if not dt > 0.0:
            raise OdometryError(f"dt must be positive, not {dt} s")
        self._now_ns += max(round(dt * 1e9), 1)
        return self._now_ns

    def _process(self, reading: Reading) -> MotionEstimate:
        self.belief = process_reading(self._body, self.belief, reading)
        return estimate_of(self.belief)
