"""Segments that may be legs or bodies of people, and the evidence for each."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.people.background import Background
from chefbot.people.observation import Floats, Observation
from chefbot.people.segmentation import Segments

MAX_WIDTH = 0.6
"""Largest width of a person across, with a coat or a bag, m."""
LEG_WIDTH = (0.08, 0.24)
"""Width of one leg with trousers, m."""
BODY_WIDTH = (0.2, 0.5)
"""Width of both legs seen as one segment, m."""
LEG_GAP = 0.04
"""Distance of neighbouring beams beyond which the gap between two legs may be missed, m."""
LEG_DISTANCE = (0.12, 0.45)
"""Distance of the two legs of a person, m; at most half a step."""
CHAIN_GAP, MAX_CHAIN = 0.3, 1.5
"""Distance of neighbouring segments up to which they belong together, and maximum extent that is not a wall, m."""
MAP_MARGIN, MAP_MARGIN_GROWTH = 0.1, 0.02
"""Distance from an obstacle of the map within which a return belongs to it, m, and its growth with the range, rad."""
NEAR_DISTANCE = 2.5
"""Distance within which a person gives several returns, m."""
LEG_DEPTH, SECOND_LEG = 0.055, 0.07
"""Distance of a leg's centre behind the mean of its returns, and of a person's centre behind that if the other leg is
hidden, m."""
LEG_DEVIATION, SINGLE_LEG_DEVIATION = 0.06, 0.11
"""Standard deviation of a person's position from two legs or a body, and from one leg, m."""
MIN_BROAD = 0.1
"""Width from which a segment of several returns is not a thin leg of furniture, m."""


class Candidates(NamedTuple):
    """m segments that may be legs or bodies of people.

    segments: their features. position: (m, 2) estimated centre of the leg or body in the tracking frame, m. broad:
    (m,) wider than the legs of furniture. leg: (m,) as wide as a leg. body: (m,) as wide as both legs, from so far
    that they are not seen apart. apart: (m,) not one of many pieces of a wall. novel: (m,) where nothing was before.
    stays: (m,) where returns have stayed. on_map: (m,) on an obstacle of the map. on_floor: (m,) on free floor
    of the map.
    """

    segments: Segments
    position: Floats
    broad: NDArray[np.bool_]
    leg: NDArray[np.bool_]
    body: NDArray[np.bool_]
    apart: NDArray[np.bool_]
    novel: NDArray[np.bool_]
    stays: NDArray[np.bool_]
    on_map: NDArray[np.bool_]
    on_floor: NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number of candidates (m in the shapes above)."""
        return self.segments.size

    def selected(self, chosen: NDArray[np.int64]) -> Candidates:
        """Return the chosen candidates (numbers)."""
        return Candidates(
            self.segments.selected(chosen),
            self.position[chosen],
            self.broad[chosen],
            self.leg[chosen],
            self.body[chosen],
            self.apart[chosen],
            self.novel[chosen],
            self.stays[chosen],
            self.on_map[chosen],
            self.on_floor[chosen],
        )

    def nearest(self, count: int) -> Candidates:
        """Return the `count` nearest candidates in the order of their beams."""
        return self.selected(np.sort(np.argsort(self.segments.range, kind="stable")[:count]))

    def beams(self, chosen: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
        """Return which of `count` beams belong to the chosen candidates (m,)."""
        mask = np.zeros(count + 1, np.int64)
        np.add.at(mask, self.segments.first[chosen], 1)
        np.add.at(mask, self.segments.last[chosen] + 1, -1)
        return np.cumsum(mask)[:count] > 0


def find_candidates(
    observation: Observation,
    segments: Segments,
    background: Background,
    map_T_frame: SE2 | None,
    free_after: float,
    max_range: float,
) -> Candidates:
    """Return the segments within `max_range` metres that are no wider than a person and upright.

    free_after: time (s) after which a place was free if it is new that something is there.
    """
    few = (segments.returns < 2) & (segments.range < NEAR_DISTANCE)
    # The ends of a wall all around the sensor are neighbours.
    around = segments.returns * observation.spacing > math.pi
    mask = (segments.width <= MAX_WIDTH) & (segments.range <= max_range) & (segments.upright >= 0.5)
    mask &= ~few & ~around
    kept = segments.selected(mask)
    apart = _chain_extents(observation, segments)[mask] <= MAX_CHAIN
    was_free, stays = background.was_free(kept.centre, free_after)
    # A beam's footprint widens a segment that only two of them meet.
    width = kept.width + 0.5 * observation.spacing * kept.range
    broad = (kept.returns >= 2) & (width >= MIN_BROAD)
    leg = (kept.returns >= 3) & (kept.width >= LEG_WIDTH[0]) & (kept.width <= LEG_WIDTH[1]) & ~kept.hidden
    body = (kept.returns >= 3) & (kept.width >= BODY_WIDTH[0]) & (kept.width <= BODY_WIDTH[1]) & ~kept.hidden
    body &= apart & (observation.spacing * kept.range > LEG_GAP)
    leg &= apart
    margin = MAP_MARGIN + MAP_MARGIN_GROWTH * kept.range
    on_map, on_floor = background.on_map(kept.centre, map_T_frame, margin)
    novel = was_free & ~stays & (on_floor | (not background.has_map))
    return Candidates(
        kept,
        _behind(observation.sensor, kept, LEG_DEPTH),
        broad,
        leg,
        body,
        apart,
        novel,
        stays,
        on_map,
        on_floor,
    )


def _chain_extents(observation: Observation, segments: Segments) -> Floats:
    """Return for each segment (m,) how far the chain of neighbouring segments that it is in extends from its first
    return, m.

    A wall seen at a small angle falls into many segments, and those around the sensor end where they begin.
    """
    if not segments.size:
        return np.zeros(0)
    points = observation.points()
    first, last = points[segments.first], points[segments.last]
    gaps = np.hypot(*(first[1:] - last[:-1]).T)
    chain = np.concatenate([[0], np.cumsum(gaps > CHAIN_GAP)])
    begins = np.searchsorted(chain, np.arange(chain[-1] + 1))
    away = np.hypot(*(last - first[begins][chain]).T)
    return np.asarray(np.maximum.reduceat(away, begins)[chain])


def _behind(sensor: SE2, segments: Segments, depth: float) -> Floats:
    """Return the points `depth` metres behind the centres of segments as seen from the sensor, (m, 2)."""
    origin = np.array([sensor.x, sensor.y])
    away = segments.centre - origin
    return origin + away * (1.0 + depth / np.maximum(segments.range, depth))[:, None]


class Measurement(NamedTuple):
    """Position of a person, m, with its standard deviation along each axis, and the evidence of its candidates."""

    x: float
    y: float
    deviation: float
    novel: bool
    pair: bool
    body: bool
    leg: bool
    on_map: bool


def measure(candidates: Candidates, chosen: NDArray[np.int64], sensor: SE2) -> Measurement:
    """Return the measurement of the person to whom the chosen candidates (1 or 2 numbers) belong."""
    points, segments = candidates.position[chosen], candidates.segments
    width = float(segments.width[chosen].max())
    single = len(chosen) == 1 and width < LEG_WIDTH[1]
    centre = points.mean(axis=0)
    if single and segments.range[chosen[0]] < NEAR_DISTANCE:
        centre = _between_legs(centre, sensor)
    pair = len(chosen) == 2 and bool(candidates.leg[chosen].all()) and _apart(points)
    return Measurement(
        float(centre[0]),
        float(centre[1]),
        SINGLE_LEG_DEVIATION if single else LEG_DEVIATION,
        bool((candidates.novel & candidates.broad)[chosen].any()),
        pair,
        bool((candidates.body & candidates.on_floor)[chosen].any()),
        bool((candidates.leg & candidates.on_floor)[chosen].any()),
        bool(candidates.on_map[chosen].all()),
    )


def _between_legs(leg: Floats, sensor: SE2) -> Floats:
    # both legs would be seen: the other one is behind this one
    away = leg - np.array([sensor.x, sensor.y])
    return leg + SECOND_LEG * away / max(float(np.hypot(*away)), SECOND_LEG)


def _apart(points: Floats) -> bool:
    """Return whether two points (2, 2) are as far apart as a person's legs."""
    return LEG_DISTANCE[0] <= float(np.hypot(*(points[0] - points[1]))) <= LEG_DISTANCE[1]


def group_legs(candidates: Candidates, free: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return candidates (numbers) in groups of one or two that may be the legs of a person, nearest pairs first."""
    groups: list[NDArray[np.int64]] = []
    points = candidates.position[free]
    gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) if len(free) else np.zeros((0, 0))
    first, second = np.triu_indices(len(free), 1)
    near = gaps[first, second] <= LEG_DISTANCE[1]
    first, second = first[near], second[near]
    used = np.zeros(len(free), np.bool_)
    for k in np.argsort(gaps[first, second], kind="stable"):
        i, j = first[k], second[k]
        if not used[i] and not used[j]:
            used[[i, j]] = True
            groups.append(free[[i, j]])
    return groups + [free[[i]] for i in np.flatnonzero(~used)]
