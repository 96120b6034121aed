"""A camera robot stops before drop-offs of 3 cm and more; bench/bench_drop_offs.py makes more of these drives."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.chaos.drop_off_drive import Approach, approach_edge, draw_approach

STEEP = Approach(depth=0.03, distance=1.6, yaw=0.9, speed=1.4, by_path=True)


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 9, 11])
def test_a_camera_robot_stops_before_a_drop_off(tmp_path: Path, seed: int) -> None:
    approach = draw_approach(seed)
    arrival = approach_edge(approach, tmp_path, seed)
    assert not arrival.over
    assert arrival.speed > 0.1 and arrival.gap < 0.5 * approach.distance  # it did drive there


@pytest.mark.rotated("drives towards obstacles")
@pytest.mark.slow
@pytest.mark.parametrize("robot", ["chefbot", "chefbot_lidar"])
def test_a_fast_robot_stops_before_an_oblique_step(tmp_path: Path, robot: str) -> None:
    assert not approach_edge(STEEP, tmp_path, 1, robot).over
