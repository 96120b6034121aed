"""State of all people and of what is around them, as flat arrays for the kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STAND, WALK, APPROACH = 0, 1, 2
"""Modes of a person: stands and looks at its aim; walks to a destination; goes straight to its aim."""


class Walkers(NamedTuple):
    """State of n people; metres, seconds and radians in the map frame.

    position, velocity, force, heading: (n, 2); force is an acceleration, heading a unit vector.
    aim: (n, 2) the point that a person goes to or, standing, looks at. course: (n, 2) the next point on the path.
    pace: (n,) speed that each wants to walk. mode: (n,) STAND, WALK or APPROACH.
    destination: (n,) number of the navigation function of a person who walks.
    group: (n,) number of the group, -1 for none. shy: (n,) whether a person avoids the robot.
    stuck: (n,) time for which a person has not got on. sees: (n, n) whether nothing stands between two people.
    """

    position: Floats
    velocity: Floats
    force: Floats
    heading: Floats
    aim: Floats
    course: Floats
    pace: Floats
    mode: NDArray[np.int64]
    destination: NDArray[np.int64]
    group: NDArray[np.int64]
    shy: NDArray[np.bool_]
    stuck: Floats
    sees: NDArray[np.bool_]


class Surroundings(NamedTuple):
    """What people move in; metres and seconds in the map frame.

    distance: (h, w) to the nearest obstacle that never moves, on a grid with `frame` (3,). path_costs: (k, H, W)
    navigation functions on a coarser grid with `path_frame` (3,), tenths of a cell to each destination. leaves:
    (m, 4) ends of the door leaves. discs: (c, 3) x, y, radius of the chairs that can be moved. robot: (3,) x, y and
    radius. seen: (4,) position and velocity of the robot as people see it. sight: distance within which they see it.
    """

    distance: NDArray[np.float32]
    frame: Floats
    path_costs: NDArray[np.int32]
    path_frame: Floats
    leaves: Floats
    discs: Floats
    robot: Floats
    seen: Floats
    sight: float


def walkers_at(positions: Floats, headings: Floats) -> Walkers:
    """Return people who stand at the positions (n, 2) with these headings (n, 2)."""
    n = len(positions)
    return Walkers(
        position=positions.copy(),
        velocity=np.zeros((n, 2)),
        force=np.zeros((n, 2)),
        heading=headings.copy(),
        aim=positions + headings,
        course=positions.copy(),
        pace=np.ones(n),
        mode=np.full(n, STAND),
        destination=np.zeros(n, dtype=np.int64),
        group=np.full(n, -1),
        shy=np.ones(n, dtype=np.bool_),
        stuck=np.zeros(n),
        sees=np.zeros((n, n), dtype=np.bool_),
    )
