"""Prints hashes of the results of mapping and localization on a simulated drive.

`python -m tests.support.filter_hash`: the results of two processors, or of two settings of Numba, are bit-identical
if the lines are equal.
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


def hash_of(*arrays: NDArray[np.generic]) -> str:
    """Return a hash of the bytes of the arrays."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[
        :16
    ]


def drive() -> list[tuple[SE2, SE2, NDArray[np.float32]]]:
    """Return true pose, odometry and scan every half metre of a lap."""
    world, truth = World.of(RING), ring_drive()[::5]
    odometry = drifting_odometry(truth, 1, 0.03, 0.03, 0.005)
    return [(a, b, world.ranges(a, ANGLES, REACH)) for a, b in zip(truth, odometry, strict=True)]


def build_map(steps: list[tuple[SE2, SE2, NDArray[np.float32]]]) -> tuple[Grid, str]:
    """Return the map and a hash of map and trajectory."""
    slam = Gmapping(GmappingParams(particles=12, seed=1), initial=steps[0][0])
    for _, odom, ranges in steps:
        slam.update(ANGLES.astype(np.float32), ranges, odom, range_max=REACH)
    grid = slam.map()
    return grid, hash_of(np.array(slam.trajectory()), grid.cells)


def localize(grid: Grid, steps: list[tuple[SE2, SE2, NDArray[np.float32]]], known: bool) -> str:
    """Return a hash of poses, covariances and particles of Amcl, with or without an initial pose."""
    amcl = Amcl(AmclParams(max_particles=3000, seed=1), grid, IDENTITY)
    if known:
        amcl.set_pose(steps[0][0], 0.3, 0.2)
    states = []
    for _, odom, ranges in steps[:20]:
        amcl.update(ANGLES, ranges, REACH, odom)
        states += [amcl.pose.array(), amcl.covariance.ravel(), amcl.particles.ravel()]
    return hash_of(*states)


def weights_hash(grid: Grid) -> str:
    """Return a hash of log-likelihoods for numbers of beams that do not fill the lanes of vector instructions."""
    rng, field = np.random.default_rng(1), LikelihoodField.of(grid, AmclParams())
    particles = field.sample_free_space(2000, rng)
    numbers = (1, 2, 3, 5, 60, 61, 62, 63, 64, 181)
    return hash_of(*(field.log_likelihoods(particles, rng.uniform(-REACH, REACH, (n, 2))) for n in numbers))


def lines() -> list[str]:
    """Return a name and a hash in each line."""
    steps = drive()
    grid, mapping = build_map(steps)
    tracking, globally = localize(grid, steps, True), localize(grid, steps, False)
    return [
        f"mapping {mapping}",
        f"weights {weights_hash(grid)}",
        f"tracking {tracking}",
        f"global localization {globally}",
    ]


if __name__ == "__main__":
    sys.stdout.write("\n".join(lines()) + "\n")
