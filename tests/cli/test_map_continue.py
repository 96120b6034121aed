"""Maps that go on: continued by a drive that begins elsewhere, and merged, with both algorithms."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.cli.map.continued import continue_map, merge_maps
from chefbot.cli.map.edit import print_info
from chefbot.cli.map.slam import run_slam
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.storage.map_files import load_map
from chefbot.storage.mapped_drives import load_drives

BEAMS = 180
CORNERS = (
    (0, 0),
    (9, 0),
    (9, 3),
    (5, 3),
    (5, 7),
    (8, 7),
    (8, 9),
    (0, 9),
    (0, 5.5),
    (1.5, 5.5),
    (1.5, 4),
    (0, 4),
)
"""Of a building without symmetry, m."""
WALLS = np.array([(*a, *b) for a, b in zip(CORNERS, (*CORNERS[1:], CORNERS[0]), strict=True)], np.float64)
LOOP = ((1.5, 1.5), (7.5, 1.5), (3.0, 2.0), (3.0, 8.0), (6.5, 8.0), (3.0, 8.0), (3.0, 2.0), (1.5, 1.5))
ELSEWHERE = ((6.5, 8.0), (3.0, 8.0), (3.0, 5.0), (3.0, 1.5), (7.0, 1.5))


def ranges_at(pose: SE2) -> NDArray[np.float64]:
    """Return the ranges (BEAMS,) of a laser that looks ahead, from -90 degrees on."""
    angles = pose.yaw - math.pi / 2 + np.arange(BEAMS) * math.pi / BEAMS
    direction = np.column_stack([np.cos(angles), np.sin(angles)])
    begin, along = WALLS[:, :2], WALLS[:, 2:] - WALLS[:, :2]
    to_wall = begin - (pose.x, pose.y)
    cross = direction[:, :1] * along[:, 1] - direction[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (to_wall[:, 0] * along[:, 1] - to_wall[:, 1] * along[:, 0]) / cross
        share = (to_wall[:, 0] * direction[:, 1:] - to_wall[:, 1] * direction[:, :1]) / cross
    hit = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(hit, distance, np.inf).min(axis=1)


def poses_along(points: tuple[tuple[float, float], ...], step: float = 0.1) -> list[SE2]:
    """Return the poses of a robot that turns in place at each point, and drives straight between them."""
    poses, yaw = [SE2(*points[0], 0.0)], 0.0
    for (ax, ay), (bx, by) in pairwise(points):
        wanted = math.atan2(by - ay, bx - ax)
        turn = math.remainder(wanted - yaw, math.tau)
        steps = max(1, math.ceil(abs(turn) / 0.15))
        poses += [SE2(ax, ay, yaw + turn * (i + 1) / steps) for i in range(steps)]
        yaw, length = wanted, math.hypot(bx - ax, by - ay)
        count = math.ceil(length / step)
        poses += [
            SE2(ax + (bx - ax) * (i + 1) / count, ay + (by - ay) * (i + 1) / count, yaw) for i in range(count)
        ]
    return poses


def write_log(path: Path, points: tuple[tuple[float, float], ...], odom_frame: SE2, seed: int) -> list[SE2]:
    """Write a CARMEN log of a drive whose odometry drifts in a frame of its own; return the true poses."""
    rng, poses, odom, lines = np.random.default_rng(seed), poses_along(points), odom_frame, list[str]()
    for number, pose in enumerate(poses):
        if number:
            x, y, yaw = poses[number - 1].between(pose)
            noise = rng.normal(size=3) * (0.03 * abs(x) + 1e-4, 1e-3, 0.02 * abs(yaw) + 1e-3)
            odom = odom @ SE2(x + noise[0], y + noise[1], yaw + noise[2])
        measured = ranges_at(pose) + rng.normal(size=BEAMS) * 0.01
        where = f"{odom.x:.6f} {odom.y:.6f} {odom.yaw:.6f}"
        lines.append(
            f"FLASER {BEAMS} {' '.join(f'{r:.3f}' for r in measured)} {where} {where} {number} h {number}"
        )
    path.write_text("\n".join(lines) + "\n")
    return poses


@pytest.mark.rotated("maps of two drives")
@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["gmapping", "graph"])
@pytest.mark.parametrize("given", [False, True])
def test_a_drive_that_begins_elsewhere_continues_the_map(algorithm: str, given: bool, tmp_path: Path) -> None:
    first, second = tmp_path / "first.log", tmp_path / "second.log"
    before = write_log(first, LOOP, SE2(3.0, -1.0, 0.7), seed=1)
    after = write_log(second, ELSEWHERE, SE2(-20.0, 5.0, 2.0), seed=3)
    run_slam(first, tmp_path / "map", algorithm, particles=8, seed=1, max_range=20.0)
    start = before[0].between(after[0]) if given else None
    continue_map(
        tmp_path / "map", second, tmp_path / "on", None if start is None else tuple(start), report=True
    )
    drives = load_drives(tmp_path / "on" / "map.bundle")
    assert len(drives.sessions) == 2
    rows = np.loadtxt(tmp_path / "on" / "trajectory.tum")
    own = rows[int(drives.sessions[0].used.sum()) :]
    errors = [
        math.hypot(row[1] - true.x, row[2] - true.y)
        for row in own
        for true in [before[0].between(after[int(row[0])])]
    ]
    assert len(errors) > (20 if given else 5) and float(np.median(errors)) < 0.08 and max(errors) < 0.3
    assert (
        load_map(tmp_path / "on" / "map.bundle").cells == load_map(tmp_path / "on" / "map.yaml").cells
    ).all()
    assert "report.html" in [path.name for path in (tmp_path / "on").iterdir()]
    old, new = load_map(tmp_path / "map" / "map.yaml"), load_map(tmp_path / "on" / "map.yaml")
    assert (new.cells == 100).sum() < 1.6 * (old.cells == 100).sum(), "no wall is drawn twice"


@pytest.mark.rotated("maps of two drives")
@pytest.mark.slow
def test_two_maps_of_a_building_are_merged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, points, seed in (("a", LOOP, 1), ("b", ELSEWHERE, 3)):
        write_log(tmp_path / f"{name}.log", points, SE2(float(seed), 0.0, 0.3 * seed), seed)
        run_slam(tmp_path / f"{name}.log", tmp_path / name, "graph", particles=2, seed=1, max_range=20.0)
    merge_maps(tmp_path / "a", tmp_path / "b", tmp_path / "both", report=False)
    assert len(load_drives(tmp_path / "both").sessions) == 2
    print_info(tmp_path / "both")
    text = capsys.readouterr().out
    assert "2 sessions, pose graph" in text and "the origin" in text


@pytest.mark.rotated("maps of two drives")
@pytest.mark.slow
@pytest.mark.parametrize("start", [(40.0, 1.0, 0.0), (2.0, 1.0, 2.0)])
def test_a_wrong_start_is_refused(start: tuple[float, float, float], tmp_path: Path) -> None:
    for name, points, seed in (("a", LOOP, 1), ("b", ELSEWHERE, 3)):
        write_log(tmp_path / f"{name}.log", points, SE2(0.0, 0.0, 0.0), seed)
    run_slam(tmp_path / "a.log", tmp_path / "a", "graph", particles=2, seed=1, max_range=20.0)
    with pytest.raises(UserError, match="does not fit the map"):
        continue_map(tmp_path / "a", tmp_path / "b.log", tmp_path / "on", start, report=False)
    assert not (tmp_path / "on").exists()


def test_arguments_that_make_no_sense_are_refused_at_once(tmp_path: Path) -> None:
    log = tmp_path / "none.log"
    with pytest.raises(UserError, match="is not a pose on a map"):
        continue_map(tmp_path, log, tmp_path / "on", (math.nan, 0.0, 0.0), report=False)
    with pytest.raises(UserError, match="is the folder of the map that is continued"):
        continue_map(tmp_path, log, tmp_path, None, report=False)


@pytest.mark.rotated("maps of two drives")
@pytest.mark.slow
def test_a_drive_in_another_building_changes_nothing(tmp_path: Path) -> None:
    write_log(tmp_path / "a.log", LOOP, SE2(0.0, 0.0, 0.0), 1)
    run_slam(tmp_path / "a.log", tmp_path / "a", "graph", particles=2, seed=1, max_range=20.0)
    lines = [
        f"FLASER {BEAMS} {'0.7 ' * BEAMS}{0.3 * i} 0 0 {0.3 * i} 0 0 {i} h {i}" for i in range(40)
    ]  # a tube
    (tmp_path / "b.log").write_text("\n".join(lines))
    with pytest.raises(UserError, match="do not show where on the map it begins"):
        continue_map(tmp_path / "a", tmp_path / "b.log", tmp_path / "on", None, report=False)
    assert not (tmp_path / "on").exists()
