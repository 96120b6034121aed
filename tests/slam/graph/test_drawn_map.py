"""The map of a pose graph that is drawn bit by bit is that which is drawn at once."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.pillar_room import ANGLES, circle, ranges_at

from chefbot.maths.se2 import IDENTITY
from chefbot.slam.graph.drawn_map import MAX_OFFSET_CHANGE, MAX_SHIFT, DrawnMap
from chefbot.slam.scan_beams import Beams, beams_of

POSES = np.array([pose.array() for pose in circle(0.5)])


@pytest.fixture(scope="module")
def scans() -> list[Beams]:
    angles = ANGLES.astype(np.float32)
    return [beams_of(angles, ranges_at(pose), IDENTITY, 12.0, 3.0) for pose in circle(0.5)]


def at_once(scans: list[Beams], poses: np.ndarray, offset: float = 0.0) -> bytes:
    return DrawnMap(0.05, 10_000_000).draw(scans, poses, offset).cells.tobytes()


def test_scans_that_stay_are_drawn_once(scans: list[Beams]) -> None:
    drawn = DrawnMap(0.05, 10_000_000)
    for count in (1, 2, 40, 40, len(scans)):
        grid = drawn.draw(scans[:count], POSES[:count], 0.0)
    assert grid.cells.tobytes() == at_once(scans, POSES)
    nearly = POSES + np.array([0.5 * MAX_SHIFT, 0.0, 0.0])
    assert drawn.draw(scans, nearly, 0.0).cells.tobytes() == grid.cells.tobytes(), "too little to be seen"


@pytest.mark.parametrize("motion", [(3 * MAX_SHIFT, 0.0, 0.0), (0.0, 0.0, 0.01)])
def test_scans_that_have_moved_are_drawn_again(
    scans: list[Beams], motion: tuple[float, float, float]
) -> None:
    drawn = DrawnMap(0.05, 10_000_000)
    drawn.draw(scans[:60], POSES[:60], 0.0)
    moved = POSES.copy()
    moved[10:] += motion
    assert drawn.draw(scans, moved, 0.0).cells.tobytes() == at_once(scans, moved)


def test_small_motions_do_not_add_up(scans: list[Beams]) -> None:
    drawn, poses = DrawnMap(0.05, 10_000_000), POSES.copy()
    for _ in range(40):
        poses = poses + np.array([0.4 * MAX_SHIFT, 0.0, 0.0])
        grid = drawn.draw(scans, poses, 0.0)
    exact = DrawnMap(0.05, 10_000_000).draw(scans, poses, 0.0)
    assert abs(grid.origin_x - exact.origin_x) <= 0.05


def test_another_correction_of_the_ranges_draws_all_again(scans: list[Beams]) -> None:
    drawn = DrawnMap(0.05, 10_000_000)
    drawn.draw(scans[:30], POSES[:30], 0.0)
    offset = 5 * MAX_OFFSET_CHANGE
    assert drawn.draw(scans, POSES, offset).cells.tobytes() == at_once(scans, POSES, offset)
