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
from chefbot.slam.params import GmappingParams
from chefbot.slam.scan_beams import Beams, beams_of
from chefbot.slam.session import Session
from chefbot.slam.systematic_errors import OdometrySteps, odometry_steps, systematic_errors, windowed

Array = NDArray[np.float64]
MIN_SCALE, MAX_SCALE = 0.002, 4.0
"""Limits of the factor by which the variances of odometry are scaled: a gyro is much better than assumed."""
MEDIAN_CHI_SQUARED = 0.455
"""Median of the square of a normally distributed variable with variance 1."""


class AdjustedMap(NamedTuple):
    """The poses of the used scans in the map frame, the map at these poses, and the correction of all ranges, m."""

    poses: list[SE2]
    grid: Grid
    range_offset: float


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
        _features(sessions, params.match_range), start, odometry_steps(sessions, start), wide
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
    features: list[ScanFeatures], poses: Array, steps: OdometrySteps, calibrates_ranges: bool
) -> tuple[Array, float]:
    """Return the adjusted poses (n, 3), and the correction of all ranges, m."""
    if len(poses) < 2:
        return poses, 0.0
    steps = systematic_errors(steps, poses).removed_from(steps)
    adjustment = Adjustment(features, calibrates_ranges)
    return adjustment.adjusted(poses, partial(_edges, steps)), adjustment.range_offset


def _edges(steps: OdometrySteps, poses: Array) -> Edges:
    """Return the steps as edges, with the noise that they have at these poses."""
    variances = _noise_scale(steps, poses) * steps.variances
    return odometry_edges(steps.motions, variances[:, :, None] * np.eye(3))


def _noise_scale(steps: OdometrySteps, poses: Array) -> Array:
    """Return the factors (3,) on the assumed variances that the errors of odometry at these poses show.

    Errors are added up over WINDOW steps, as those of a wheel's radius do not cancel. The median is that of a normal
    distribution, without the steps in which a wheel slipped.
    """
    error = relative(poses[:-1], poses[1:]) - steps.motions
    error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
    total, variance = (windowed(values, steps.joins) for values in (error, steps.variances))
    if not len(total):
        return np.ones(3)
    ratio = total**2 / variance
    across, turn = np.median(ratio[:, :2]), np.median(ratio[:, 2])
    return np.clip(np.array([across, across, turn]) / MEDIAN_CHI_SQUARED, MIN_SCALE, MAX_SCALE)
