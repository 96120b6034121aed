"""Hashes of what the filters make of a drive round a ring, one line each: `python -m tests.support.filter_hash`.

Two processors, or two settings of Numba's, that print different lines would localize or map differently.
"""

from __future__ import annotations

import hashlib
import sys

import numpy as np
from numpy.typing import NDArray

from chefbot.localization.amcl import Amcl
from chefbot.localization.likelihood_field import LikelihoodField
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam import Gmapping, GmappingParams
from tests.slam.conftest import RING, World, drifting_odometry, ring_drive

ANGLES = np.linspace(-np.pi, np.pi, 181)[:-1]
REACH = 10.0


def short(*arrays: NDArray[np.generic]) -> str:
    """Of their bytes."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in arrays)).hexdigest()[:16]


def drive() -> list[tuple[SE2, SE2, NDArray[np.float32]]]:
    """Truth, odometry and scan, every half metre of a good lap."""
    world, truth = World.of(RING), ring_drive()[::5]
    odometry = drifting_odometry(truth, 1, 0.03, 0.03, 0.005)
    return [(a, b, world.ranges(a, ANGLES, REACH)) for a, b in zip(truth, odometry, strict=True)]


def mapped(steps: list[tuple[SE2, SE2, NDArray[np.float32]]]) -> tuple[Grid, str]:
    """The map, and the hash of it and of the way there."""
    slam = Gmapping(GmappingParams(particles=12, seed=1), initial=steps[0][0])
    for _, odom, ranges in steps:
        slam.update(ANGLES.astype(np.float32), ranges, odom, range_max=REACH)
    grid = slam.map()
    return grid, short(np.array(slam.trajectory()), grid.cells)


def localized(grid: Grid, steps: list[tuple[SE2, SE2, NDArray[np.float32]]], known: bool) -> str:
    """Of the poses, covariances and particles of Amcl on the way, from a click or from nothing."""
    amcl = Amcl(AmclParams(max_particles=3000, seed=1), grid, IDENTITY)
    if known:
        amcl.set_pose(steps[0][0], 0.3, 0.2)
    seen = []
    for _, odom, ranges in steps[:20]:
        amcl.update(ANGLES, ranges, REACH, odom)
        seen += [amcl.pose.array(), amcl.covariance.ravel(), amcl.particles.ravel()]
    return short(*seen)


def weighed(grid: Grid) -> str:
    """Of the log-likelihoods of poses all over the map, for numbers of beams that leave lanes unfilled."""
    rng, field = np.random.default_rng(1), LikelihoodField.of(grid, AmclParams())
    particles = field.sample_free_space(2000, rng)
    numbers = (1, 2, 3, 5, 60, 61, 62, 63, 64, 181)
    return short(*(field.log_likelihoods(particles, rng.uniform(-REACH, REACH, (n, 2))) for n in numbers))


def lines() -> list[str]:
    """A name and a hash each."""
    steps = drive()
    grid, mapping = mapped(steps)
    tracking, globally = localized(grid, steps, True), localized(grid, steps, False)
    return [
        f"mapping {mapping}",
        f"weights {weighed(grid)}",
        f"tracking {tracking}",
        f"global localization {globally}",
    ]


if __name__ == "__main__":
    sys.stdout.write("\n".join(lines()) + "\n")
