"""The search for the place on a map at which a drive begins."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.pillar_room import ANGLES, circle, mapped, ranges_at

from chefbot.localization.start_search import StartSearch
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.params import GmappingParams

BEAMS = ANGLES.astype(np.float32)
NOISE = GmappingParams().odometry_noise


@pytest.fixture(scope="module")
def room() -> Grid:
    return mapped()


@pytest.mark.parametrize("start", [SE2(1.5, 0.3, 2.0), SE2(0.0, 0.5, -1.0), SE2(2.5, -0.8, 0.4)])
def test_a_drive_is_found_on_the_map(room: Grid, start: SE2) -> None:
    search = StartSearch(room, IDENTITY, NOISE)
    for odom in circle(2.0):
        true = start @ odom
        found = search.update(BEAMS, ranges_at(true), 12.0, odom)
        if found is not None:
            break
    assert found is not None and search.updates >= 5
    assert found.distance(true) < 0.15 and abs(found.between(true).yaw) < 0.1


def test_a_robot_without_beams_is_not_searched(room: Grid) -> None:
    search = StartSearch(room, IDENTITY, NOISE)
    nothing = np.empty(0, np.float32)
    assert all(search.update(nothing, nothing, 12.0, odom) is None for odom in circle(1.0))
    assert search.updates == 0
