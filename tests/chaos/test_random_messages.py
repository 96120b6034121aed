"""Tests that no random message on an input of any launch ends or blocks it, and that the robot drives afterwards."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from chefbot.robot.load import load_robot
from chefbot.runtime.launch import built_in_launches
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places
from tests.chaos.launch_process import free_port
from tests.chaos.random_messages import LIMIT_MS, LIMITS_MS, MAIN_LAUNCHES

CPU_PER_MESSAGE, MIN_CPU = 1.0, 600.0
"""CPU time of a run in seconds: hundreds of times what it needs, but less than a loop over 1e10 cells takes."""
TOLERANCE = 5.0
"""Factor on the limits, since CPU time depends on the processor and on what shares its caches."""
ARRIVED = 0.3
TOTAL = 100_000
"""Number of messages of all launches together; `make test` runs one of them, `make test-long` all."""
ROBOTS = ("chefbot_lidar", "chefbot", "jackal")
"""A robot with lidar and camera, one with a camera only, a rectangular one with a lidar only."""
CASES = [
    (launch, robot)
    for launch in built_in_launches()
    for robot in (ROBOTS if launch in MAIN_LAUNCHES else ROBOTS[:1])
]
SHARE_OF_MAIN = 0.7
"""Share of the messages that go to the launches in MAIN_LAUNCHES, which contain all nodes."""


def message_count(launch: str) -> int:
    """Return how many messages a launch gets with each of its robots, a share of TOTAL."""
    main = launch in MAIN_LAUNCHES
    share = SHARE_OF_MAIN if main else 1.0 - SHARE_OF_MAIN
    return math.ceil(TOTAL * share / sum((one in MAIN_LAUNCHES) == main for one, _ in CASES))


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
    command += ["--count", str(count), "--map", str(room), "--port", str(free_port())]
    command += ["--cpu", str(round(MIN_CPU + CPU_PER_MESSAGE * count)), *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr[-3000:]}"
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    assert result["accepted"] == count  # they passed the bridge's checks and reached the nodes
    assert result["invalid_own"] == {}
    assert result["unexpected"] == 0, result["faults"]
    slow = {
        name: worst
        for name, worst in result["worst_ms"].items()
        if worst > TOLERANCE * LIMITS_MS.get(name, LIMIT_MS)
    }
    assert not slow, result["slow"]
    return result


@pytest.mark.rotated("invalid messages")
@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 7, 11])
def test_two_thousand_random_messages_do_not_stop_navigation(room: Path, seed: int) -> None:
    result = publish_random_messages("waiter", "chefbot_lidar", 2_000, room, "--goal", "--seed", str(seed))
    assert result["goal_distance"] < ARRIVED, result


@pytest.mark.rotated("invalid messages")
@pytest.mark.slow
@pytest.mark.parametrize(("launch", "robot"), CASES)
def test_random_messages_end_and_block_no_launch(launch: str, robot: str, room: Path) -> None:
    more = ("--web-ui",) if launch in MAIN_LAUNCHES else ()
    publish_random_messages(launch, robot, message_count(launch), room, "--seed", "13", *more)


def test_all_launches_together_get_100_000_messages() -> None:
    assert {launch for launch, _ in CASES} == set(built_in_launches())
    assert sum(message_count(launch) for launch, _ in CASES) >= TOTAL
