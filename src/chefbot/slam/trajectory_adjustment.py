"""Joint adjustment of a mapper's trajectory: all scans that see the same surfaces are registered with each other.

A particle filter never corrects a pose that it has left. After the drive, each scan counts for all poses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.slam.graph.adjustment import Adjustment
from chefbot.slam.graph.drawn_map import DrawnMap
from chefbot.slam.graph.edges import Edges
from chefbot.slam.graph.odometry_model import odometry_edges
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.graph.range_calibration import has_wide_view
from chefbot.slam.graph.relative_poses import relative
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.motion_model import OdometryStep
from chefbot.slam.params import GmappingParams
from chefbot.slam.scan_beams import Beams, beams_of
from chefbot.slam.session import START_STD_XY, START_STD_YAW, Session

Array = NDArray[np.float64]
ASSUMED = GraphSlamParams()
"""Its odometry noise is assumed, and then scaled."""
MIN_SCALE, MAX_SCALE = 0.002, 4.0
"""Limits of the factor by which the variances of odometry are scaled: a gyro is much better than assumed."""
MEDIAN_CHI_SQUARED = 0.455
"""Median of the square of a normally distributed variable with variance 1."""
REGRESSIONS, OUTLIER = 4, 4.0
"""Number of regressions of the systematic errors, and the error in medians from which a step is left out."""
WINDOW = 10
"""Number of steps over which errors of odometry are added up."""
START_VARIANCE = np.array([START_STD_XY, START_STD_XY, START_STD_YAW]) ** 2
"""Variance of the pose at which another drive begins, m^2 and rad^2."""


class AdjustedMap(NamedTuple):
    """The poses of the used scans in the map frame, the map at these poses, and the correction of all ranges, m."""

    poses: list[SE2]
    grid: Grid
    range_offset: float


class _Steps(NamedTuple):
    """Motions (n - 1, 3) between used scans by odometry, m and rad, and their assumed variances (n - 1, 3).

    joins: (n - 1,) whether a step leads to another drive, about which odometry shows nothing.
    """

    motions: Array
    variances: Array
    joins: NDArray[np.bool_]


def adjusted_map(
    sessions: Sequence[Session], poses: Sequence[SE2], params: GmappingParams | GraphSlamParams
) -> AdjustedMap:
    """Return the map of drives after a joint adjustment of its poses; the first one stays.

    poses: of all used scans. params: of the mapper, for the resolution and the ranges of the map. Returns that
    mark no cell are registered up to its `match_range`: those of a depth camera are too noisy to be drawn, but far
    walls show the heading best. Raises ScanError if the numbers of used scans and of poses differ.
    """
    beams = [one for session in sessions for one in _beams(session, params.max_range, params.clear_range)]
    if len(beams) != len(poses) or not poses:
        raise ScanError(f"the drives have {len(beams)} used scans, but there are {len(poses)} poses")
    start = np.array([pose.array() for pose in poses])
    wide = all(has_wide_view(session.angles[: session.beams[0]]) for session in sessions)
    adjusted, offset = _adjusted(
        _features(sessions, params.match_range), start, _steps(sessions, start), wide
    )
    grid = DrawnMap(params.resolution, params.max_cells).draw(beams, adjusted, offset)
    return AdjustedMap([SE2(x, y, wrap(yaw)) for x, y, yaw in adjusted.tolist()], grid, offset)


def _features(sessions: Sequence[Session], match_range: float) -> list[ScanFeatures]:
    beams = (one for session in sessions for one in _beams(session, match_range, 0.0))
    return [ScanFeatures.of(one, match_range) for one in beams]


def _beams(session: Session, max_range: float, clear_range: float) -> Iterator[Beams]:
    laser = SE2.of(session.laser)
    for scan in session.scans():
        if len(scan.ranges):
            ranges = np.where(scan.ranges >= session.range_max, np.float32(math.inf), scan.ranges)
            yield beams_of(scan.angles, ranges, laser, max_range, clear_range)


def _adjusted(
    features: list[ScanFeatures], poses: Array, steps: _Steps, calibrates_ranges: bool
) -> tuple[Array, float]:
    """Return the adjusted poses (n, 3), and the correction of all ranges, m."""
    if len(poses) < 2:
        return poses, 0.0
    steps = _calibrated(steps, poses)
    adjustment = Adjustment(features, calibrates_ranges)
    return adjustment.adjusted(poses, partial(_edges, steps)), adjustment.range_offset


def _steps(sessions: Sequence[Session], poses: Array) -> _Steps:
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
    return _Steps(np.array(motions).reshape(-1, 3), np.array(variances).reshape(-1, 3), np.array(joins, bool))


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


def _edges(steps: _Steps, poses: Array) -> Edges:
    """Return the steps as edges, with the noise that they have at these poses."""
    variances = _noise_scale(steps, poses) * steps.variances
    return odometry_edges(steps.motions, variances[:, :, None] * np.eye(3))


def _noise_scale(steps: _Steps, poses: Array) -> Array:
    """Return the factors (3,) on the assumed variances that the errors of odometry at these poses show.

    Errors are added up over WINDOW steps, as those of a wheel's radius do not cancel. The median is that of a normal
    distribution, without the steps in which a wheel slipped.
    """
    error = relative(poses[:-1], poses[1:]) - steps.motions
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    total, variance = (_windowed(values, steps.joins) for values in (error, steps.variances))
    if not len(total):
        return np.ones(3)
    ratio = total**2 / variance
    across, turn = np.median(ratio[:, :2]), np.median(ratio[:, 2])
    return np.clip(np.array([across, across, turn]) / MEDIAN_CHI_SQUARED, MIN_SCALE, MAX_SCALE)


def _windowed(values: Array, joins: NDArray[np.bool_]) -> Array:
    """Return the totals (m, 3) of each WINDOW consecutive rows of values (n, 3) that belong to one drive."""
    window = min(WINDOW, len(values))
    view = np.lib.stride_tricks.sliding_window_view
    return view(values, window, axis=0).sum(axis=-1)[~view(joins, window).any(axis=-1)]


def _calibrated(steps: _Steps, poses: Array) -> _Steps:
    """Return the steps without the systematic errors of odometry that the mapper's poses show.

    Those are a factor on distances, one on turns, and a turn per distance, as of wheels that are too small, too far
    apart, or unequal (Borenstein & Feng 1996). Steps in which a wheel slipped do not count.
    """
    found = relative(poses[:-1], poses[1:])
    found[:, 2] = np.arctan2(np.sin(found[:, 2]), np.cos(found[:, 2]))
    driven, seen = _windowed(steps.motions, steps.joins), _windowed(found, steps.joins)
    if not len(driven):
        return steps
    (scale,) = _regression(driven[:, :1], seen[:, 0], np.ones(1))
    turn, bend = _regression(driven[:, [2, 0]], seen[:, 2], np.array([1.0, 0.0]))
    motions = steps.motions * np.array([scale, scale, turn])
    motions[:, 2] += bend * steps.motions[:, 0]
    return steps._replace(motions=np.where(steps.joins[:, None], steps.motions, motions))


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
