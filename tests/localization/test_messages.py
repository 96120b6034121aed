"""Tests the messages of localization: pose, status and a sample of the particles."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.localization.amcl import Amcl
from chefbot.localization.messages import (
    SHOWN_PARTICLES,
    particle_cloud,
    pose_message,
    same_grid,
    status_message,
)
from chefbot.localization.params import AmclParams
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2

STAMP = 3_000_000_000


def room(occupied: int = 0) -> Grid:
    cells = np.zeros((60, 60), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    cells[10, 10] = occupied
    return Grid(cells, 0.05, 0.0, 0.0)


@pytest.fixture
def amcl() -> Amcl:
    amcl = Amcl(AmclParams(seed=1), room(), IDENTITY)
    amcl.set_pose(SE2(1.5, 1.5, 0.3), 0.02, 0.02)
    return amcl


def test_at_most_a_sample_of_the_particles_is_shown(amcl: Amcl) -> None:
    cloud = particle_cloud(amcl, STAMP)
    assert 0 < len(cloud.particles) < 2 * SHOWN_PARTICLES
    assert len(cloud.particles) <= len(amcl.particles) and cloud.header.stamp.ns == STAMP
    assert cloud.particles[0].pose.se2.distance(SE2(1.5, 1.5, 0.3)) < 0.3


def test_pose_and_status_are_those_of_the_filter(amcl: Amcl) -> None:
    message, status = pose_message(amcl, STAMP), status_message(amcl, STAMP)
    assert message.header.frame_id == "map" and message.pose.pose.se2.distance(amcl.pose) < 1e-9
    assert message.pose.planar_covariance == pytest.approx(amcl.covariance)
    assert status.localized == amcl.converged and status.probability == pytest.approx(
        amcl.quality.probability
    )


def test_maps_are_the_same_by_geometry_and_cells() -> None:
    assert same_grid(room(), room())
    assert not same_grid(room(), room(100))
    moved = Grid(room().cells, 0.05, 1.0, 0.0)
    assert not same_grid(room(), moved)
