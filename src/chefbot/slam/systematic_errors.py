"""Systematic errors of odometry in the drives of a map: what the mapper's poses show of its wheels."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.graph.relative_poses import relative
from chefbot.slam.motion_model import OdometryStep
from chefbot.slam.session import START_STD_XY, START_STD_YAW, Session

Array = NDArray[np.float64]
ASSUMED = GraphSlamParams()
"""Its odometry noise is assumed, and then scaled."""
REGRESSIONS, OUTLIER = 4, 4.0
"""Number of regressions of the systematic errors, and the error in medians from which a step is left out."""
WINDOW = 10
"""Number of steps over which errors of odometry are added up."""
MIN_DRIVEN = 5.0
"""Distance from which drives show the errors of odometry, m."""
START_VARIANCE = np.array([START_STD_XY, START_STD_XY, START_STD_YAW]) ** 2
"""Variance of the pose at which another drive begins, m^2 and rad^2."""


class OdometrySteps(NamedTuple):
    """Motions (n - 1, 3) between used scans by odometry, m and rad, and their assumed variances (n - 1, 3).

    joins: (n - 1,) whether a step leads to another drive, about which odometry shows nothing.
    """

    motions: Array
    variances: Array
    joins: NDArray[np.bool_]


class SystematicErrors(NamedTuple):
    """Errors of odometry that add up: a factor on distances, one on turns, and a turn per distance, rad/m.

    They are those of wheels that are too small, too far apart, or unequal (Borenstein & Feng 1996). True motions are
    these factors times those of odometry.
    """

    distance: float
    turn: float
    bend: float

    def removed_from(self, steps: OdometrySteps) -> OdometrySteps:
        """Return the steps without these errors."""
        motions = steps.motions * np.array([self.distance, self.distance, self.turn])
        motions[:, 2] += self.bend * steps.motions[:, 0]
        return steps._replace(motions=np.where(steps.joins[:, None], steps.motions, motions))


NO_ERRORS = SystematicErrors(1.0, 1.0, 0.0)
"""What odometry that measures well has."""


def odometry_steps(sessions: Sequence[Session], poses: Array) -> OdometrySteps:
    """Return the steps of odometry; that to the first scan of another drive is the one of the mapper."""
    motions, variances, joins = list[Array](), list[Array](), list[bool]()
    for session in sessions:
        if session is not sessions[0]:
            k = len(motions)
            motions.append(relative(poses[k : k + 1], poses[k + 1 : k + 2])[0])
            variances.append(START_VARIANCE)
            joins.append(True)
        for step in _odometry(session):
            motions.append(step.motion.array())
            variances.append(step.variance(ASSUMED))
            joins.append(False)
    return OdometrySteps(
        np.array(motions).reshape(-1, 3), np.array(variances).reshape(-1, 3), np.array(joins, bool)
    )


def _odometry(session: Session) -> Iterator[OdometryStep]:
    """Yield the motion from each used scan of a drive to the next one."""
    step, last, has_begun = OdometryStep(), SE2.of(session.odometry[0]), False
    for scan in session.scans():
        step.add(last.between(scan.odom))
        last = scan.odom
        if len(scan.ranges):
            if has_begun:
                yield step
            step, has_begun = OdometryStep(), True


def systematic_errors(steps: OdometrySteps, poses: Array) -> SystematicErrors:
    """Return the errors that poses (n, 3) of the used scans show. Steps in which a wheel slipped do not count."""
    found = relative(poses[:-1], poses[1:])
    found[:, 2] = np.arctan2(np.sin(found[:, 2]), np.cos(found[:, 2]))
    driven, seen = windowed(steps.motions, steps.joins), windowed(found, steps.joins)
    if not len(driven):
        return NO_ERRORS
    (scale,) = _regression(driven[:, :1], seen[:, 0], np.ones(1))
    turn, bend = _regression(driven[:, [2, 0]], seen[:, 2], np.array([1.0, 0.0]))
    return SystematicErrors(float(scale), float(turn), float(bend))


def errors_of_drives(sessions: Sequence[Session], poses: Sequence[SE2]) -> SystematicErrors | None:
    """Return the errors of odometry that the poses of all used scans of a map show, or None if it is too short."""
    if len(poses) < 2 or not sessions:
        return None
    found = np.array([pose.array() for pose in poses])
    steps = odometry_steps(sessions, found)
    driven = np.abs(steps.motions[~steps.joins, 0]).sum()
    return systematic_errors(steps, found) if driven >= MIN_DRIVEN else None


def windowed(values: Array, joins: NDArray[np.bool_]) -> Array:
    """Return the totals (m, 3) of each WINDOW consecutive rows of values (n, 3) that belong to one drive."""
    window = min(WINDOW, len(values))
    view = np.lib.stride_tricks.sliding_window_view
    return view(values, window, axis=0).sum(axis=-1)[~view(joins, window).any(axis=-1)]


def _regression(inputs: Array, outputs: Array, expected: Array) -> Array:
    """Return the coefficients (k,) of inputs (n, k) for outputs (n,), without the outputs that fit worst.

    The expected ones count as an output of one metre or radian each: a robot that hardly moves shows no others.
    """
    kept, unit = np.ones(len(outputs), bool), np.eye(len(expected))
    for _ in range(REGRESSIONS):
        rows, values = np.vstack([unit, inputs[kept]]), np.concatenate([expected, outputs[kept]])
        coefficients: Array = np.linalg.lstsq(rows, values, rcond=None)[0]
        error = np.abs(outputs - inputs @ coefficients)
        kept = error <= OUTLIER * np.median(error)
    return coefficients
