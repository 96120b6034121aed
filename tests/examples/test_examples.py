"""The examples run as their first lines say, and do what they claim."""

from __future__ import annotations

import importlib
import itertools
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from tests.support.waiting import PATIENCE

from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.planning.params import PlannerParams
from chefbot.planning.planner import PlanningError, PlanningFailure

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(*arguments: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command in a folder of its own."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.fixture(scope="module")
def own_planner() -> ModuleType:
    """examples/01_a_planner.py, which no import statement can name."""
    sys.path.insert(0, str(EXAMPLES))
    try:
        return importlib.import_module("01_a_planner")
    finally:
        sys.path.remove(str(EXAMPLES))


def test_the_loop_example_is_short() -> None:
    assert len((EXAMPLES / "00_one_loop.py").read_text().splitlines()) < 80


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_the_loop_example_maps_the_room_and_returns(tmp_path: Path) -> None:
    done = run(str(EXAMPLES / "00_one_loop.py"), "map.png", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "with 0 collisions" in done.stdout
    off = re.search(r"home: (\d+) mm", done.stdout)
    assert off and int(off[1]) < 50
    width, height = Image.open(tmp_path / "map.png").size
    assert abs(width * 0.05 - 5.0) < 0.3 and abs(height * 0.05 - 4.0) < 0.3


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_example_planner_drives_the_robot_through_the_room(tmp_path: Path) -> None:
    done = run(str(EXAMPLES / "01_a_planner.py"), folder=tmp_path)
    assert done.returncode == 0, done.stderr
    paths = re.search(r"planner: Wavefront, (\d+) paths", done.stdout)
    assert paths and int(paths[1]) > 3
    assert "Everything within reach is seen. 0 collisions." in done.stdout


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_launch_finds_the_planner_beside_its_file(tmp_path: Path) -> None:
    arguments = ["world:=room", "robot:=chefbot_lidar", "headless:=true", "speed:=0", "duration:=1"]
    found = run("-m", "chefbot", "launch", str(EXAMPLES / "01_a_planner.yaml"), *arguments, folder=tmp_path)
    assert found.returncode == 0, found.stderr
    shutil.copy(EXAMPLES / "01_a_planner.yaml", tmp_path)
    lost = run("-m", "chefbot", "launch", "01_a_planner.yaml", *arguments, folder=tmp_path)
    assert lost.returncode == 2
    assert "01_a_planner" in lost.stderr and len(lost.stderr.strip().splitlines()) == 1


def costmap(free: np.ndarray) -> Costmap:
    """Free or inscribed, with an origin that is not zero."""
    return Costmap(np.where(free, 0, INSCRIBED).astype(np.uint8), 0.1, -1.0, 2.0)


@settings(max_examples=60)
@given(seed=st.integers(0, 10_000), share=st.floats(0.5, 1.0))
def test_example_planner_moves_between_adjacent_free_cells(
    own_planner: ModuleType, seed: int, share: float
) -> None:
    rng = np.random.default_rng(seed)
    free = rng.random((20, 30)) < share
    start, goal = (
        (int(rng.integers(20)), int(rng.integers(30))),
        (int(rng.integers(20)), int(rng.integers(30))),
    )
    free[start] = free[goal] = True
    came = own_planner.wave(free, goal, start)
    path = own_planner.walk_down(came, start)
    if not path:
        assert came[start] < 0
        return
    assert path[0] == start and path[-1] == goal
    assert all(free[cell] for cell in path)
    assert all(max(abs(a[0] - b[0]), abs(a[1] - b[1])) == 1 for a, b in itertools.pairwise(path))


def test_example_planner_path_joins_robot_and_goal(own_planner: ModuleType) -> None:
    start, goal = SE2(-0.55, 2.25, 0.3), SE2(1.72, 3.81, -2.0)
    path = own_planner.Wavefront(PlannerParams()).plan(costmap(np.ones((20, 30), bool)), start, goal)
    assert tuple(path[0, :2]) == (start.x, start.y)
    assert tuple(path[-1]) == tuple(goal)


@pytest.mark.parametrize(
    ("goal", "failure"),
    [
        (SE2(9.0, 2.5, 0.0), PlanningFailure.GOAL_OUTSIDE_MAP),
        (SE2(0.55, 2.5, 0.0), PlanningFailure.GOAL_OCCUPIED),
        (SE2(1.55, 2.5, 0.0), PlanningFailure.NO_VALID_PATH),
    ],
)
def test_example_planner_names_the_reason_of_a_failure(
    own_planner: ModuleType, goal: SE2, failure: PlanningFailure
) -> None:
    free = np.ones((20, 30), bool)
    free[:, 15] = False  # a wall across the map
    with pytest.raises(PlanningError) as raised:
        own_planner.Wavefront(PlannerParams()).plan(costmap(free), SE2(-0.5, 2.5, 0.0), goal)
    assert raised.value.failure is failure
