"""Tests that random messages on the inputs of all nodes crash no launch and that the robot navigates afterwards."""

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

CPU_PER_MESSAGE, MIN_CPU = 1.0, 600.0
"""CPU time of a run in seconds: hundreds of times what it needs, but less than a loop over 1e10 cells takes."""
ARRIVED = 0.3
LONG = [
    ("waiter", "chefbot_lidar", 40_000, ("--web-ui",)),
    ("waiter", "chefbot", 20_000, ("--web-ui",)),
    ("explore", "chefbot_lidar", 20_000, ("--web-ui",)),
    ("explore", "chefbot", 10_000, ("--web-ui",)),
    ("calibrate_sim", "chefbot_lidar", 10_000, ()),
]


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Map and places of the room, saved."""
    path = tmp_path_factory.mktemp("map") / "room.yaml"
    world = load_any_world("room", load_robot("chefbot_lidar"))
    save_map(path, floor_plan(world, load_robot("chefbot_lidar").sensors.lidar.mount.z))
    save_places(places_path(path), world.places)
    return path


def publish_random_messages(launch: str, robot: str, count: int, room: Path, *more: str) -> dict[str, Any]:
    """Return the result; a signal, an exit or too much CPU time fails with the last messages that were published."""
    command = [sys.executable, "-m", "tests.chaos.random_messages", "--launch", launch, "--robot", robot]
    command += [
        "--count",
        str(count),
        "--map",
        str(room),
        "--cpu",
        str(round(MIN_CPU + CPU_PER_MESSAGE * count)),
    ]
    done = subprocess.run([*command, *more], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr[-3000:]}"
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    assert result["sent"] == count
    assert result["accepted"] > 0.4 * count  # most have to pass the bridge's checks, to test the nodes
    assert result["invalid_own"] == {}
    return result


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 7, 11])
def test_two_thousand_random_messages_do_not_stop_navigation(room: Path, seed: int) -> None:
    result = publish_random_messages("waiter", "chefbot_lidar", 2_000, room, "--goal", "--seed", str(seed))
    assert result["unexpected"] == 0, result["faults"]
    assert result["goal_distance"] < ARRIVED, result


@pytest.mark.long
@pytest.mark.parametrize(("launch", "robot", "count", "more"), LONG)
def test_a_hundred_thousand_random_messages_crash_nothing(
    launch: str, robot: str, count: int, more: tuple[str, ...], room: Path
) -> None:
    result = publish_random_messages(launch, robot, count, room, "--seed", "7", *more)
    assert result["unexpected"] == 0, result["faults"]
