"""Wheels, the sensor's place and the places of all stands by least squares: what the ticks say of each drive
against what the scans saw at its ends.

The idea is that of Censi, Franchi, Marchionni, Oriolo: Simultaneous calibration of odometry and sensor parameters for
mobile robots, IEEE Transactions on Robotics 29 (2), 2013. Here the stands are unknown too: a narrow view fixes a pose
in some directions only; in the others the wheels decide, with the numbers that are sought, not the assumed ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.calibration.alignment import Link
from chefbot.calibration.drive import Leg
from chefbot.calibration.wheels import Wheels, length_of, travelled
from chefbot.errors import UserError
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

Array = NDArray[np.float64]
UNKNOWNS = 6
"""Shares by which left wheel, right wheel and separation differ, then x, y, yaw of the sensor."""
MOUNT_DEVIATION = 0.005
"""m: how well the place of a sensor is known, seen from above; its yaw is not taken as known."""
FIRST_NOISE = (0.01, 0.005)
"""m and rad: what a drive's residual may be before the drives themselves have told."""
LEAST_NOISE = (2e-3, 1.5e-3)
"""No wheels on no floor roll better."""
OUTLIER = 6.0
"""Standard deviations; a drive further off is one on which a wheel slipped."""
MOST_OUTLIERS = 0.25
"""With a larger share of slips the rest cannot be trusted either."""
MOST_NOISE = (0.04, 0.03)
"""m and rad of a drive of no length."""
LEAST_LEGS = 8
MEDIAN_TO_SIGMA = 1.4826
ROUNDS = 5
"""Of telling slips from noise; fewer where nothing changes any more."""
STEPS, CLOSE = 10, 1e-5
NUDGE = 1e-6
KNOWN = 1e8
"""Inverse variance of what is not asked for: the first stand, where the frame begins, or all that are known."""
ANYWHERE = 1.0 / 0.3**2
"""The same of all stands, m and rad: where they were thought to be on the way."""
LINK_OUTLIER = 5.0
"""Standard deviations from which on a link has not half of its force left."""


class Solution(NamedTuple):
    """wheels: m per tick and m. sensor: its pose on the robot. poses: of the sensor at all stands.

    covariance: (6, 6) of shares of left, right, separation, then x, y m and yaw rad of the sensor.
    noise: standard deviations of a drive of no length, m and rad. slipped: (n,) which drives were left out.
    """

    wheels: Wheels
    sensor: SE2
    poses: list[SE2]
    covariance: Array
    noise: tuple[float, float]
    slipped: NDArray[np.bool_]

    @property
    def deviations(self) -> Array:
        """Standard deviations (6,) of what `covariance` is of."""
        return np.sqrt(self.covariance.diagonal())


def solve(
    legs: Sequence[Leg],
    links: Sequence[Link],
    poses: Sequence[SE2],
    wheels: Wheels,
    sensor: SE2,
    known: int = 0,
) -> Solution:
    """From `wheels` and the `sensor`'s place as the robot file has them, and first guesses of all `poses`.

    known: so many of the first poses, and with them the sensor's place, are known already and stay.
    UserError where there are too few drives, or where too many do not fit any wheels.
    """
    if len(legs) < LEAST_LEGS:
        raise UserError(
            f"{len(legs)} drives are too few to calibrate by; {LEAST_LEGS} at least, straight and turning, are needed"
        )
    problem = _Problem(legs, links, poses, wheels, sensor, known)
    noise, slipped = FIRST_NOISE, np.zeros(len(legs), np.bool_)
    at = problem.start()
    for _ in range(ROUNDS):
        at = problem.fit(at, noise, slipped)
        errors, before = problem.errors(at), (noise, slipped)
        noise = _noise(errors, slipped)
        slipped = _far(errors, noise)
        if noise == before[0] and (slipped == before[1]).all():
            break
    _check(noise, slipped)  # not sooner: what slips pulls at its neighbours until it is known to
    return problem.solution(at, noise, slipped)


def _check(noise: tuple[float, float], slipped: NDArray[np.bool_]) -> None:
    slips, advice = int(slipped.sum()), "clean tyres and floor, drive where nobody walks, and calibrate again"
    if slipped.mean() > MOST_OUTLIERS:
        raise UserError(
            f"{slips} of {len(slipped)} drives fit no wheels: they slip, or the walls move; {advice}"
        )
    if noise[0] > MOST_NOISE[0] or noise[1] > MOST_NOISE[1]:
        raise UserError(
            f"the drives fit no wheels, by {1000 * noise[0]:.0f} mm and {math.degrees(noise[1]):.1f} deg as a rule: "
            f"they slip, or the walls move; {advice}"
        )


def _noise(errors: Array, slipped: NDArray[np.bool_]) -> tuple[float, float]:
    """By the medians, which slips do not move."""
    kept = np.abs(errors[~slipped])
    shift, turn = MEDIAN_TO_SIGMA * np.median(kept[:, :2]), MEDIAN_TO_SIGMA * np.median(kept[:, 2])
    return max(float(shift), LEAST_NOISE[0]), max(float(turn), LEAST_NOISE[1])


def _far(errors: Array, noise: tuple[float, float]) -> NDArray[np.bool_]:
    scaled = np.abs(errors) / np.array([noise[0], noise[0], noise[1]])
    return np.asarray((scaled > OUTLIER).any(axis=1))


def _of(stand: int) -> slice:
    """Its unknowns."""
    return slice(UNKNOWNS + 3 * stand, UNKNOWNS + 3 * stand + 3)


def _difference(seen: SE2, told: SE2) -> Array:
    return np.array([seen.x - told.x, seen.y - told.y, wrap(seen.yaw - told.yaw)])


def _moved(begin: SE2, seen: SE2) -> Array:
    """How `seen`, the second of two poses from the first one, changes with x, y, yaw of both: (3, 6)."""
    c, s = math.cos(begin.yaw), math.sin(begin.yaw)
    return np.array(
        [
            [-c, -s, seen.y, c, s, 0.0],
            [s, -c, -seen.x, -s, c, 0.0],
            [0.0, 0.0, -1.0, 0.0, 0.0, 1.0],
        ]
    )


class _Problem:
    """Unknowns (6 + 3 n,): those of the robot, then x, y, yaw of the n stands.

    A drive on which wheels slip pulls with a bounded force (Huber 1964) until it is left out.
    """

    def __init__(
        self,
        legs: Sequence[Leg],
        links: Sequence[Link],
        poses: Sequence[SE2],
        wheels: Wheels,
        sensor: SE2,
        known: int = 0,
    ) -> None:
        self._legs, self._links, self._poses = legs, links, poses
        self._wheels, self._sensor, self._known = wheels, sensor, known
        # a longer drive may be off further, with the root of its length: a random walk (Chong & Kleeman 1997)
        self._stretch = np.array([math.sqrt(1.0 + length_of(leg.ticks, wheels)) for leg in legs])

    def start(self) -> Array:
        """Nothing differs, and every stand is where it was thought to be."""
        return np.concatenate([np.zeros(UNKNOWNS), np.array(self._poses).ravel()])

    def wheels(self, at: Array) -> Wheels:
        left, right, separation = (1.0 + at[:3]).tolist()
        return Wheels(
            self._wheels.left * left, self._wheels.right * right, self._wheels.separation * separation
        )

    def sensor(self, at: Array) -> SE2:
        return SE2.of(self._sensor.array() + at[3:UNKNOWNS])

    def pose(self, at: Array, stand: int) -> SE2:
        return SE2.of(at[_of(stand)])

    def errors(self, at: Array) -> Array:
        """(n, 3): m, m, rad by which the motion of the sensor between stands differs from that by the wheels."""
        return np.array([self._error(at, leg) for leg in self._legs]) / self._stretch[:, None]

    def _error(self, at: Array, leg: Leg, rolled: SE2 | None = None) -> Array:
        """`rolled`: the robot's motion by the wheels, where that is known already."""
        begin, end = (self.pose(at, stand) for stand in leg.stands)
        sensor, motion = self.sensor(at), rolled or travelled(leg.ticks, self.wheels(at))
        return _difference(begin.between(end), sensor.inverse() @ motion @ sensor)

    def fit(self, at: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]) -> Array:
        """Gauss-Newton."""
        for _ in range(STEPS):
            H, g = self._normal(at, noise, slipped)
            step = np.linalg.solve(H, g)
            at = at - step
            if np.abs(step).max() < CLOSE:
                break
        return at

    def _normal(
        self, at: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """J^T W J and J^T W r."""
        H, g = np.zeros((len(at), len(at))), np.zeros(len(at))
        mount = [KNOWN] * 3 if self._known else [1.0 / MOUNT_DEVIATION**2] * 2 + [0.0]
        H[3:UNKNOWNS, 3:UNKNOWNS], g[3:UNKNOWNS] = np.diag(mount), mount * at[3:UNKNOWNS]
        for stand, pose in enumerate(self._poses):
            firm = KNOWN if stand < max(self._known, 1) else ANYWHERE
            H[_of(stand), _of(stand)] += firm * np.eye(3)
            g[_of(stand)] += firm * _difference(self.pose(at, stand), pose)
        for link in self._links:
            self._hold(H, g, at, link)
        for leg, stretch, out in zip(self._legs, self._stretch, slipped, strict=True):
            if not out:
                self._add(H, g, at, leg, stretch * np.array([noise[0], noise[0], noise[1]]))
        return H, g

    def _hold(self, H: Array, g: Array, at: Array, link: Link) -> None:
        """A link of two stands; one that contradicts the others pulls the less (Geman & McClure 1985)."""
        begin, end = self.pose(at, link.first), self.pose(at, link.second)
        seen = begin.between(end)
        error = _difference(seen, link.pose)
        J = _moved(begin, seen)
        force = link.information @ error
        information = link.information / (1.0 + float(error @ force) / LINK_OUTLIER**2) ** 2
        columns = [_of(stand).start + k for stand in (link.first, link.second) for k in range(3)]
        H[np.ix_(columns, columns)] += J.T @ information @ J
        g[columns] += J.T @ information @ error

    def _add(self, H: Array, g: Array, at: Array, leg: Leg, deviation: Array) -> None:
        rolled = travelled(leg.ticks, self.wheels(at))
        error = self._error(at, leg, rolled) / deviation
        weight = min(1.0, OUTLIER / max(float(np.abs(error).max()), 1e-9))
        columns = [*range(UNKNOWNS), *(_of(stand).start + k for stand in leg.stands for k in range(3))]
        J = np.empty((3, len(columns)))
        for column in range(UNKNOWNS):
            nudged = at.copy()
            nudged[column] += NUDGE
            same = rolled if column >= 3 else None
            J[:, column] = (self._error(nudged, leg, same) / deviation - error) / NUDGE
        begin, end = (self.pose(at, stand) for stand in leg.stands)
        J[:, UNKNOWNS:] = _moved(begin, begin.between(end)) / deviation[:, None]
        H[np.ix_(columns, columns)] += weight * J.T @ J
        g[columns] += weight * J.T @ error

    def solution(self, at: Array, noise: tuple[float, float], slipped: NDArray[np.bool_]) -> Solution:
        """With the covariance of the linearised problem."""
        H, _ = self._normal(at, noise, slipped)
        covariance: Array = np.asarray(np.linalg.inv(H)[:UNKNOWNS, :UNKNOWNS], np.float64)
        poses = [self.pose(at, stand) for stand in range(len(self._poses))]
        poses = [SE2(pose.x, pose.y, wrap(pose.yaw)) for pose in poses]
        sensor = self.sensor(at)
        return Solution(
            self.wheels(at), SE2(sensor.x, sensor.y, wrap(sensor.yaw)), poses, covariance, noise, slipped
        )
