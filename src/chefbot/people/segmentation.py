"""Segments of neighbouring returns, and their features.

Jump-distance segmentation; features as in Arras, Mozos and Burgard 2007, "Using boosted features for the detection of
people in 2D range data".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chefbot.people.observation import Floats, Observation

JUMP, JUMP_BEAMS = 0.08, 2.2
"""Distance of neighbouring returns beyond which a segment ends: m, or, if that is more, distances of the beams."""
OCCLUSION = 0.15
"""Distance by which the return beside a segment must be nearer to hide a part of it, m."""
MAX_SEGMENTS = 2000
FEATURES = 5


class Segments(NamedTuple):
    """m segments of an observation.

    first, last: (m,) numbers of their beams. centre: (m, 2) mean of the returns, in the tracking frame, m. range:
    (m,) of the centre from the sensor, m. width: (m,) distance of the ends, m. returns: (m,) their number. upright:
    (m,) share of the returns that may belong to a person by their height. hidden: (m,) whether something nearer hides
    an end. through_gap: (m,) whether something nearer hides both ends.
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    centre: Floats
    range: Floats
    width: Floats
    returns: Floats
    upright: Floats
    hidden: NDArray[np.bool_]
    through_gap: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of segments (m in the shapes above)."""
        return len(self.first)

    def selected(self, mask: NDArray[np.bool_] | NDArray[np.int64]) -> Segments:
        """Return the segments for which `mask` (m,) is true, or those with these numbers."""
        return Segments(
            self.first[mask],
            self.last[mask],
            self.centre[mask],
            self.range[mask],
            self.width[mask],
            self.returns[mask],
            self.upright[mask],
            self.hidden[mask],
            self.through_gap[mask],
        )


@njit(cache=True, nogil=True)
def _segment(
    points: Floats,
    ranges: Floats,
    upright: NDArray[np.bool_],
    spacing: float,
    limits: tuple[float, float, float],
    beams: NDArray[np.int64],
    features: Floats,
) -> int:
    """Write first and last beam (m, 2) and features (m, 5) of the segments, and return their number.

    limits: JUMP, JUMP_BEAMS, OCCLUSION. features: mean x and y, width, share of upright returns, number
    of hidden ends.
    """
    n, m, first = len(ranges), 0, -1
    for i in range(n + 1):
        # A segment ends at a beam without return, at a jump, and after the last beam.
        ends = first >= 0 and (i == n or np.isnan(ranges[i]))
        if first >= 0 and not ends:
            dx, dy = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
            jump = max(limits[0], limits[1] * spacing * min(ranges[i], ranges[i - 1]))
            ends = dx * dx + dy * dy > jump * jump
        if ends and m < len(beams):
            last = i - 1
            beams[m, 0], beams[m, 1] = first, last
            x, y, up = 0.0, 0.0, 0
            for k in range(first, last + 1):
                x, y, up = x + points[k, 0], y + points[k, 1], up + upright[k]
            count = last - first + 1
            features[m, 0], features[m, 1], features[m, 3] = x / count, y / count, up / count
            features[m, 2] = np.sqrt(
                (points[last, 0] - points[first, 0]) ** 2 + (points[last, 1] - points[first, 1]) ** 2
            )
            # A nearer return beside an end hides what may be behind it.
            before = first > 0 and ranges[first - 1] < ranges[first] - limits[2]
            after = last < n - 1 and ranges[last + 1] < ranges[last] - limits[2]
            features[m, 4] = (1.0 if before else 0.0) + (1.0 if after else 0.0)
            m += 1
        if ends:
            first = -1
        if first < 0 and i < n and not np.isnan(ranges[i]):
            first = i
    return m


def find_segments(observation: Observation) -> Segments:
    """Return the segments of an observation, at most MAX_SEGMENTS."""
    beams = np.zeros((MAX_SEGMENTS, 2), np.int64)
    features = np.zeros((MAX_SEGMENTS, FEATURES))
    m = _segment(
        observation.points(),
        observation.ranges,
        observation.upright,
        observation.spacing,
        (JUMP, JUMP_BEAMS, OCCLUSION),
        beams,
        features,
    )
    first, last = beams[:m, 0], beams[:m, 1]
    x, y, width, upright, hidden = features[:m].T
    distance = np.hypot(x - observation.sensor.x, y - observation.sensor.y)
    centre, count = np.column_stack([x, y]), (last - first + 1).astype(np.float64)
    return Segments(first, last, centre, distance, width, count, upright, hidden > 0.5, hidden > 1.5)
