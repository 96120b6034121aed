"""Simultaneous least-squares estimation of wheel parameters, sensor pose and all station poses.

The residuals are the motion by the ticks of each drive against the scan matches between stations. The method
follows Censi, Franchi, Marchionni, Oriolo: Simultaneous calibration of odometry and sensor parameters for
mobile robots, IEEE Transactions on Robotics 29 (2), 2013. Here the station poses are unknown too: a narrow
field of view constrains a pose in some directions only; in the others the wheels constrain it, with the
estimated parameters, not the assumed ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.alignment import ScanMatch
from chefbot.calibration.drive import DriveSegment
from chefbot.calibration.errors import CalibrationError
from chefbot.calibration.wheels import WheelParams, distance_from_ticks, integrate_ticks
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

Array = NDArray[np.float64]
ROBOT_UNKNOWNS = 6
"""Number of robot parameters: relative errors of left wheel, right wheel and separation; x, y, yaw of the
sensor."""
MOUNT_DEVIATION = 0.005
"""Prior standard deviation of the sensor's x and y on the robot, m; its yaw has no prior."""
INITIAL_NOISE = (0.01, 0.005)
"""Initial standard deviation of a drive's residual, m and rad, before it is estimated."""
MIN_NOISE = (2e-3, 1.5e-3)
"""Minimum standard deviation of a drive's residual, m and rad."""
OUTLIER = 6.0
"""Number of standard deviations beyond which a drive is an outlier with a slipping wheel."""
MAX_OUTLIERS = 0.25
"""Maximum fraction of outliers; beyond it the remaining drives are unreliable as well."""
MAX_NOISE = (0.04, 0.03)
"""Maximum standard deviation of the residual of a drive of zero length, m and rad."""
MIN_LEGS = 8
MEDIAN_TO_SIGMA = 1.4826
ROUNDS = 5
"""Maximum rounds of outlier rejection; fewer on convergence."""
STEPS, CONVERGENCE_STEP = 10, 1e-5
DIFFERENCE_STEP = 1e-6
FIXED_INFORMATION = 1e8
"""Inverse variance of fixed poses: the first station, which defines the frame, or all that are known."""
POSE_INFORMATION = 1.0 / 0.3**2
"""Prior inverse variance of all other station poses about those estimated during the drive."""
LINK_OUTLIER = 5.0
"""Scale of the robust kernel of a link, in standard deviations."""


class Solution(NamedTuple):
    """The estimated parameters and station poses.

    wheels: m per tick and m. sensor: its pose in base_link. poses: of the sensor at all stations.
    covariance: (6, 6) of relative errors of left, right, separation, then x, y m and yaw rad of the sensor.
    noise: standard deviations of a drive of zero length, m and rad. slipped: (n,) mask of the rejected
    drives.
    """

    wheels: WheelParams
    sensor: SE2
    poses: list[SE2]
    covariance: Array
    noise: tuple[float, float]
    slipped: NDArray[np.bool_]

    @property
    def deviations(self) -> Array:
        """Standard deviations (6,) of the parameters of `covariance`."""
        return np.sqrt(self.covariance.diagonal())


def solve(
    legs: Sequence[DriveSegment],
    links: Sequence[ScanMatch],
    poses: Sequence[SE2],
    wheels: WheelParams,
    sensor: SE2,
    known: int = 0,
) -> Solution:
    """Estimate wheels, sensor pose and station poses from drives and scan matches.

    wheels, sensor: first guess from the robot file. poses: first guess of all station poses. known: number of
    first poses that are fixed, and with them the sensor's pose. Raise CalibrationError if there are too few
    drives, or if too many are outliers.
    """
    if len(legs) < MIN_LEGS:
        raise CalibrationError(
            f"{len(legs)} drives are too few to calibrate; at least {MIN_LEGS}, straight and turning, are needed"
        )
    problem = _Problem(legs, links, poses, wheels, sensor, known)
    noise, slipped = INITIAL_NOISE, np.zeros(len(legs), np.bool_)
    x = problem.start()
    # Alternate: Gauss-Newton fit, noise from the residuals, outlier rejection
    for _ in range(ROUNDS):
        x = problem.fit(x, noise, slipped)
        errors, before = problem.errors(x), (noise, slipped)
        noise = _residual_noise(errors, slipped)
        slipped = _outliers(errors, noise)
        if noise == before[0] and (slipped == before[1]).all():
            break
    _check(noise, slipped)  # only now: an outlier biases its neighbours until it is rejected
    return problem.solution(x, noise, slipped)


def _check(noise: tuple[float, float], slipped: NDArray[np.bool_]) -> None:
    slips, advice = int(slipped.sum()), "clean tyres and floor, drive where no one walks, and calibrate again"
    if slipped.mean() > MAX_OUTLIERS:
        raise CalibrationError(
            f"{slips} of {len(slipped)} drives fit no wheels: they slip, or the walls move; {advice}"
        )
    if noise[0] > MAX_NOISE[0] or noise[1] > MAX_NOISE[1]:
        raise CalibrationError(
            f"the drives fit no wheels, by {1000 * noise[0]:.0f} mm and {math.degrees(noise[1]):.1f} deg as a rule: "
            f"they slip, or the walls move; {advice}"
        )


def _residual_noise(errors: Array, slipped: NDArray[np.bool_]) -> tuple[float, float]:
    """Return robust standard deviations (m, rad) from the median absolute residuals."""
    inliers = np.abs(errors[~slipped])
    shift, turn = MEDIAN_TO_SIGMA * np.median(inliers[:, :2]), MEDIAN_TO_SIGMA * np.median(inliers[:, 2])
    return max(float(shift), MIN_NOISE[0]), max(float(turn), MIN_NOISE[1])


def _outliers(errors: Array, noise: tuple[float, float]) -> NDArray[np.bool_]:
    scaled = np.abs(errors) / np.array([noise[0], noise[0], noise[1]])
    return np.asarray((scaled > OUTLIER).any(axis=1))


def _station_slice(station: int) -> slice:
    """Return the indices of a station's unknowns x, y, yaw."""
    return slice(ROBOT_UNKNOWNS + 3 * station, ROBOT_UNKNOWNS + 3 * station + 3)


def _residual(seen: SE2, predicted: SE2) -> Array:
    return np.array([seen.x - predicted.x, seen.y - predicted.y, wrap(seen.yaw - predicted.yaw)])


def _relative_pose_jacobian(begin: SE2, seen: SE2) -> Array:
    """Return the Jacobian (3, 6) of a relative pose by x, y, yaw of both poses."""
    c, s = math.cos(begin.yaw), math.sin(begin.yaw)
    return np.array(
        [
            [-c, -s, seen.y, c, s, 0.0],
            [s, -c, -seen.x, -s, c, 0.0],
            [0.0, 0.0, -1.0, 0.0, 0.0, 1.0],
        ]
    )


@dataclass(eq=False)
class _Problem:
    """The nonlinear least-squares problem over the unknowns (6 + 3 n,).

    These are the robot parameters, then x, y, yaw of the n stations. A drive with slipping wheels has a
    bounded influence (Huber 1964) until it is rejected.
    """

    _legs: Sequence[DriveSegment]
    _links: Sequence[ScanMatch]
    _poses: Sequence[SE2]
    _wheels: WheelParams
    _sensor: SE2
    _known: int

    def __post_init__(self) -> None:
        # The error grows with the root of the length: a random walk (Chong & Kleeman 1997)
        distances = [distance_from_ticks(leg.ticks, self._wheels) for leg in self._legs]
        self._length_scale = np.array([math.sqrt(1.0 + distance) for distance in distances])

    def start(self) -> Array:
        """Return the first guess: no parameter errors, station poses as estimated during the drive."""
        return np.concatenate([np.zeros(ROBOT_UNKNOWNS), np.array(self._poses).ravel()])

    def wheels(self, x: Array) -> WheelParams:
        """Return the wheel parameters of the unknowns."""
        left, right, separation = (1.0 + x[:3]).tolist()
        return WheelParams(
            self._wheels.left * left, self._wheels.right * right, self._wheels.separation * separation
        )

    def sensor(self, x: Array) -> SE2:
        """Return the sensor pose in base_link of the unknowns."""
        return SE2.of(self._sensor.array() + x[3:ROBOT_UNKNOWNS])

    def pose(self, x: Array, station: int) -> SE2:
        """Return the pose of a station of the unknowns."""
        return SE2.of(x[_station_slice(station)])

    def errors(self, x: Array) -> Array:
        """Return scan match minus odometry of the sensor's motion between stations, (n, 3): m, m, rad."""
        return np.array([self._error(x, leg) for leg in self._legs]) / self._length_scale[:, None]

    def _error(self, x: Array, leg: DriveSegment, rolled: SE2 | None = None) -> Array:
        """Return the residual (3,) of a drive; `rolled` is the robot's motion by the wheels if it is computed
        already."""
        # h = sensor^-1 * motion * sensor, compared with begin^-1 * end
        begin, end = (self.pose(x, station) for station in leg.stations)
        sensor, motion = self.sensor(x), rolled or integrate_ticks(leg.ticks, self.wheels(x))
        return _residual(begin.between(end), sensor.inverse() @ motion @ sensor)

    def fit(self, x: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]) -> Array:
        """Minimise by Gauss-Newton iterations from the unknowns `x`."""
        for _ in range(STEPS):
            H, g = self._normal(x, noise, slipped)
            # (J^T W J) dx = J^T W r
            step = np.linalg.solve(H, g)
            x = x - step
            if np.abs(step).max() < CONVERGENCE_STEP:
                break
        return x

    def _normal(
        self, x: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """Return the normal equations J^T W J and J^T W r."""
        # Prior of the sensor pose
        H, g = np.zeros((len(x), len(x))), np.zeros(len(x))
        mount = [FIXED_INFORMATION] * 3 if self._known else [1.0 / MOUNT_DEVIATION**2] * 2 + [0.0]
        sensor = slice(3, ROBOT_UNKNOWNS)
        H[sensor, sensor], g[sensor] = np.diag(mount), mount * x[sensor]
        # Priors of the station poses
        for station, pose in enumerate(self._poses):
            prior_information = FIXED_INFORMATION if station < max(self._known, 1) else POSE_INFORMATION
            H[_station_slice(station), _station_slice(station)] += prior_information * np.eye(3)
            g[_station_slice(station)] += prior_information * _residual(self.pose(x, station), pose)
        # Scan matches and drives
        for link in self._links:
            self._add_link(H, g, x, link)
        for leg, length_scale, rejected in zip(self._legs, self._length_scale, slipped, strict=True):
            if not rejected:
                self._add_drive(H, g, x, leg, length_scale * np.array([noise[0], noise[0], noise[1]]))
        return H, g

    def _add_link(self, H: Array, g: Array, x: Array, link: ScanMatch) -> None:
        """Add a scan match to the normal equations, with the robust kernel of Geman & McClure (1985)."""
        begin, end = self.pose(x, link.first), self.pose(x, link.second)
        seen = begin.between(end)
        error = _residual(seen, link.pose)
        J = _relative_pose_jacobian(begin, seen)
        weighted_error = link.information @ error
        # Weight 1 / (1 + e^2 / s^2)^2
        information = link.information / (1.0 + float(error @ weighted_error) / LINK_OUTLIER**2) ** 2
        columns = [
            _station_slice(station).start + k for station in (link.first, link.second) for k in range(3)
        ]
        H[np.ix_(columns, columns)] += J.T @ information @ J
        g[columns] += J.T @ information @ error

    def _add_drive(self, H: Array, g: Array, x: Array, leg: DriveSegment, deviation: Array) -> None:
        """Add a drive to the normal equations, with the Huber kernel."""
        rolled = integrate_ticks(leg.ticks, self.wheels(x))
        error = self._error(x, leg, rolled) / deviation
        weight = min(1.0, OUTLIER / max(float(np.abs(error).max()), 1e-9))
        columns = [
            *range(ROBOT_UNKNOWNS),
            *(_station_slice(station).start + k for station in leg.stations for k in range(3)),
        ]
        # Jacobian: numeric by the robot parameters, analytic by the station poses
        J = np.empty((3, len(columns)))
        for column in range(ROBOT_UNKNOWNS):
            perturbed = x.copy()
            perturbed[column] += DIFFERENCE_STEP
            cached_motion = rolled if column >= 3 else None
            J[:, column] = (self._error(perturbed, leg, cached_motion) / deviation - error) / DIFFERENCE_STEP
        begin, end = (self.pose(x, station) for station in leg.stations)
        J[:, ROBOT_UNKNOWNS:] = _relative_pose_jacobian(begin, begin.between(end)) / deviation[:, None]
        H[np.ix_(columns, columns)] += weight * J.T @ J
        g[columns] += weight * J.T @ error

    def solution(self, x: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]) -> Solution:
        """Return the solution with the covariance (J^T W J)^-1 of the linearised problem."""
        H, _ = self._normal(x, noise, slipped)
        covariance: Array = np.asarray(np.linalg.inv(H)[:ROBOT_UNKNOWNS, :ROBOT_UNKNOWNS], np.float64)
        poses = [self.pose(x, station) for station in range(len(self._poses))]
        poses = [SE2(pose.x, pose.y, wrap(pose.yaw)) for pose in poses]
        sensor = self.sensor(x)
        return Solution(
            self.wheels(x), SE2(sensor.x, sensor.y, wrap(sensor.yaw)), poses, covariance, noise, slipped
        )
