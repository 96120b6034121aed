"""`chefbot map quality`: a verdict, the worst regions and a picture, from the bundle of a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.cli.test_slam import log_of_a_round_room
from tests.support.pillar_room import ANGLES, circle, ranges_at
from typer.testing import CliRunner

from chefbot.cli.map.commands import map_app
from chefbot.cli.map.error_rows import rows
from chefbot.cli.map.quality import print_quality
from chefbot.cli.map.slam import run_slam
from chefbot.errors import UserError
from chefbot.slam.map_error import MapErrorEstimate, MapRegion


def estimate_of(drift: float, contradiction: float) -> MapErrorEstimate:
    regions = [MapRegion(2.0 * k, 0.0, 0.01 * k, 0.01) for k in range(8)]
    return MapErrorEstimate(drift, contradiction, 0.5, regions)


@pytest.fixture
def room_log(tmp_path: Path) -> Path:
    """The log of a robot on a circle in a room with a pillar."""
    laser, lines = f"0 {ANGLES[0]:.5f} 6.28319 {ANGLES[1] - ANGLES[0]:.6f} 20 0.01 0 {len(ANGLES)}", []
    for k, pose in enumerate(circle(1.3)):
        measured = ranges_at(pose)
        ranges = " ".join(f"{value:.3f}" for value in np.where(np.isfinite(measured), measured, 20.0))
        place = f"{pose.x:.4f} {pose.y:.4f} {pose.yaw:.4f}"
        lines.append(f"ROBOTLASER1 {laser} {ranges} 0 {place} {place} 0.5 0.5 0 0 0 {0.1 * k} host {0.1 * k}")
    path = tmp_path / "room.log"
    path.write_text("\n".join(lines))
    return path


@pytest.mark.rotated
@pytest.mark.parametrize("algorithm", ["gmapping", "graph"])
def test_a_good_map_is_called_good(algorithm: str, room_log: Path, tmp_path: Path) -> None:
    run_slam(room_log, tmp_path / "out", algorithm, particles=5, seed=1, max_range=20.0)
    result = CliRunner().invoke(map_app, ["quality", str(tmp_path / "out")], catch_exceptions=False)
    assert result.exit_code == 0 and "The map is good: its estimated error is" in result.stdout
    assert (tmp_path / "out" / "quality.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["map.png", "map.bundle", "map.pgm", "quality", "quality.jpg"])
def test_a_picture_does_not_replace_the_map(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="file with a name of its own"):
        print_quality(tmp_path, tmp_path / name)


def test_a_robot_that_stood_still_is_reported_in_a_sentence(tmp_path: Path) -> None:
    run_slam(
        log_of_a_round_room(tmp_path / "a.log"),
        tmp_path / "out",
        "gmapping",
        particles=2,
        seed=1,
        max_range=10.0,
    )
    result = CliRunner().invoke(map_app, ["quality", str(tmp_path / "out")])
    assert result.exit_code != 0 and "has stood, or only turned" in str(result.exception)
    assert not (tmp_path / "out" / "quality.png").exists()


def test_the_worst_regions_come_first() -> None:
    names = list(rows(estimate_of(0.02, 0.03)))
    assert names[:4] == ["possible drift", "contradictions", "walls seen on two passes", "around (15, 1)"]
    assert rows(estimate_of(0.02, 0.03))["around (15, 1)"] == "7 cm: no loop closure or feature holds it"


def test_of_regions_side_by_side_the_worst_is_listed() -> None:
    listed = [name for name in rows(estimate_of(0.02, 0.03)) if name.startswith("around")]
    assert listed == ["around (15, 1)", "around (11, 1)", "around (7, 1)", "around (3, 1)"]
