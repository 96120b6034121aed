"""Random legal messages on every input of every node: none ends a launch, and afterwards the robot still drives."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from chefbot.robot.load import load_robot
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

CPU_PER_MESSAGE, CPU_AT_LEAST = 1.0, 600.0
"""Seconds of CPU that a run may take: hundreds of times what it does, but not what a walk over 1e10 cells does."""
ARRIVED = 0.3
LONG = [
    ("waiter", "chefbot_lidar", 40_000, ("--page",)),
    ("waiter", "chefbot", 20_000, ("--page",)),
    ("explore", "chefbot_lidar", 20_000, ("--page",)),
    ("explore", "chefbot", 10_000, ("--page",)),
    ("calibrate_sim", "chefbot_lidar", 10_000, ()),
]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The room as a mapper would save it."""
    path = tmp_path_factory.mktemp("map") / "room.yaml"
    world = load_any_world("room", load_robot("chefbot_lidar"))
    save_map(path, floor_plan(world, load_robot("chefbot_lidar").sensors.lidar.mount.z))
    save_places(places_path(path), world.places)
    return path


def storm(launch: str, robot: str, count: int, room: Path, *more: str) -> dict[str, Any]:
    """What came of it. A signal, an exit or too much CPU fails the test, which shows what was sent last."""
    command = [sys.executable, "-m", "tests.chaos.storm", "--launch", launch, "--robot", robot]
    command += [
        "--count",
        str(count),
        "--map",
        str(room),
        "--cpu",
        str(round(CPU_AT_LEAST + CPU_PER_MESSAGE * count)),
    ]
    done = subprocess.run([*command, *more], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr[-3000:]}"
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    assert result["sent"] == count
    assert result["taken"] > 0.4 * count  # else the border does all the work
    assert result["ours"] == {}
    return result


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 7, 11])
def test_two_thousand_random_messages_do_not_stop_navigation(room: Path, seed: int) -> None:
    result = storm("waiter", "chefbot_lidar", 2_000, room, "--goal", "--seed", str(seed))
    assert result["unexpected"] == 0, result["faults"]
    assert result["left"] < ARRIVED, result


@pytest.mark.long
@pytest.mark.parametrize(("launch", "robot", "count", "more"), LONG)
def test_a_hundred_thousand_random_messages_crash_nothing(
    launch: str, robot: str, count: int, more: tuple[str, ...], room: Path
) -> None:
    result = storm(launch, robot, count, room, "--seed", "7", *more)
    assert result["unexpected"] == 0, result["faults"]
