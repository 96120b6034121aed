"""Which stands saw the same walls, and how they lie to each other by that.

Pairs of scans are matched point to line (Chen & Medioni 1991; Censi, An ICP variant using a point-to-line metric,
ICRA 2008) and become links of a graph that is solved as a whole, as Lu & Milios (Globally consistent range scan
alignment for environment mapping, Autonomous Robots 4, 1997) did. A map that grows scan by scan would keep what the
odometry believed when its first scans were added: the very error that is sought.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from chefbot.calibration.surface import END, Array, Surface
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2

REACHES = (0.3, 0.15, 0.08, 0.05)
"""m within which a point looks for its wall, from the first guess to the last step."""
STEPS, CLOSE = 3, 2e-4
"""Of each reach; fewer where one of them is below so many m and rad."""
ALIKE = math.cos(math.radians(40.0))
"""Of the angle between two normals of one wall at most."""
FEWEST = 25
"""Points that two scans must share."""
OVERLAP = 0.35
"""Share of one's points that the other saw as well."""
PARTNERS = 8
"""Links of one stand to earlier ones, spread over the drive."""
MOST_MOVED = (0.15, 0.15)
"""m and rad that a match may lie from its first guess."""
DAMPING = np.diag([1.0 / 0.03**2, 1.0 / 0.03**2, 1.0 / 0.03**2])
"""Where the walls do not hold the match it stays near where it began; this is no information."""
WAVER = 3.0
"""Times the information that noise in the lines' directions seems to give is taken off: once is the mean of it."""
ODD = 8.0
"""Points, of those that hold a direction, that may lie on another wall than they are matched with."""
SHAPE = np.diag([0.003**2, 0.003**2, 0.001**2])
"""m^2 and rad^2: what scans from two places differ by, as edges and corners show other sides."""
THINNED = 4


class Link(NamedTuple):
    """Two stands: `first_T_second` by their scans, and its inverse covariance (3, 3) of x, y m and yaw rad.

    Along a wall that alone was seen, nothing is known: there the inverse covariance is zero.
    """

    first: int
    second: int
    pose: SE2
    information: Array


def links(poses: Sequence[SE2], surfaces: Sequence[Surface], begin: int = 1) -> list[Link]:
    """Of all stands from `begin` on with earlier ones, where they share enough; `poses` as a first guess."""
    found = []
    for second in range(max(begin, 1), len(surfaces)):
        for first in _partners(surfaces[second], poses[second], poses[:second], surfaces[:second]):
            link = match(first, second, poses[first].between(poses[second]), surfaces)
            if link is not None:
                found.append(link)
    return found


def placed(surface: Surface, guess: SE2, poses: Sequence[SE2], surfaces: Sequence[Surface]) -> SE2:
    """Where a new stand is by all earlier ones at once; as guessed in a direction in which no wall holds it."""
    all_of = [*surfaces, surface]
    information, pull = DAMPING.copy(), np.zeros(3)
    for first in _partners(surface, guess, poses, surfaces):
        link = match(first, len(surfaces), poses[first].between(guess), all_of)
        if link is None:
            continue
        there = poses[first] @ link.pose
        off = np.array([there.x - guess.x, there.y - guess.y, wrap(there.yaw - guess.yaw)])
        held = _turned(link.information, poses[first].yaw)
        information, pull = information + held, pull + held @ off
    return SE2.of(guess.array() + np.linalg.solve(information, pull))


def _turned(information: Array, yaw: float) -> Array:
    """In a frame in which the old one looks along `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(R @ information @ R.T)


def _partners(surface: Surface, pose: SE2, poses: Sequence[SE2], surfaces: Sequence[Surface]) -> list[int]:
    """Stands that saw the same, spread evenly."""
    seen = pose.apply(surface.walls[::THINNED])
    if len(seen) * THINNED < FEWEST:
        return []
    able = []
    for number, (other, there) in enumerate(zip(surfaces, poses, strict=True)):
        if len(other.walls) < FEWEST:
            continue
        apart, _ = other.tree.query(there.inverse().apply(seen), distance_upper_bound=REACHES[0])
        if np.isfinite(apart).mean() > OVERLAP:
            able.append(number)
    if len(able) <= PARTNERS:
        return able
    return [able[k] for k in np.linspace(0, len(able) - 1, PARTNERS).round().astype(int)]


def match(first: int, second: int, guess: SE2, surfaces: Sequence[Surface]) -> Link | None:
    """The link of two stands, None where too little is shared."""
    target, source, at = surfaces[first], surfaces[second], guess
    for reach in REACHES:
        for _ in range(STEPS):
            shared = _shared(at, source, target, reach)
            if shared is None:
                return None
            error, J, _ = shared
            step = np.linalg.solve(J.T @ J / END**2 + DAMPING, J.T @ error / END**2)
            at = SE2.of(at.array() - step)
            if np.abs(step).max() < CLOSE:
                break
    moved = guess.between(at)
    if math.hypot(moved.x, moved.y) > MOST_MOVED[0] or abs(moved.yaw) > MOST_MOVED[1]:
        return None  # it slid along a wall to another one that looks alike
    shared = _shared(at, source, target, REACHES[-1])
    return None if shared is None else Link(first, second, at, _information(shared))


class _Shared(NamedTuple):
    """Distances of points from their lines (n,), how they change with x, y, yaw (n, 3), and by how much that is
    uncertain (n, 3)."""

    error: Array
    moves: Array
    waver: Array


def _shared(at: SE2, source: Surface, target: Surface, reach: float) -> _Shared | None:
    """Of the source's points that have a wall of their own direction within `reach`; None if they are too few.

    Beside a corner the nearest wall is often the one round it, and would push the match along its own; of the ways to
    leave out wrong pairs this is Pulli's (Rusinkiewicz & Levoy, Efficient variants of the ICP algorithm, 3DIM 2001).
    """
    there = at.apply(source.points)
    apart, nearest = target.tree.query(there, distance_upper_bound=reach)
    kept = np.isfinite(apart) & source.flat
    kept[kept] = target.flat[nearest[kept]]
    there, nearest, own = there[kept], nearest[kept], source.normals[kept]
    normals = target.normals[nearest]
    c, s = math.cos(at.yaw), math.sin(at.yaw)
    alike = np.abs((normals * (own @ np.array([[c, s], [-s, c]]))).sum(axis=1)) > ALIKE
    if alike.sum() < FEWEST:
        return None
    there, nearest, normals = there[alike], nearest[alike], normals[alike]
    arm = there - (at.x, at.y)
    error = ((there - target.middles[nearest]) * normals).sum(axis=1)
    along = np.column_stack([normals[:, 1], -normals[:, 0]])
    return _Shared(error, _moves(normals, arm), np.sqrt(target.tilts[nearest])[:, None] * _moves(along, arm))


def _moves(axes: Array, arm: Array) -> Array:
    """How far points at `arm` go along `axes` for each unit of x, y, yaw: (n, 3)."""
    return np.column_stack([axes, axes[:, 1] * arm[:, 0] - axes[:, 0] * arm[:, 1]])


def _information(shared: _Shared) -> Array:
    """(3, 3), zero in directions of which less than nothing is known."""
    J, waver = shared.moves, shared.waver
    values, axes = np.linalg.eigh((J.T @ J - WAVER * waver.T @ waver - ODD * np.eye(3)) / END**2)
    held = (axes * np.maximum(values, 0.0)) @ axes.T
    # (held^-1 + SHAPE)^-1, which is there where `held` has no inverse as well
    return np.asarray(held - held @ np.linalg.solve(held + np.linalg.inv(SHAPE), held))
