"""Tests the demo from exploration to delivery by its command line."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.support.run_hash import messages

from chefbot.demo.demo import LAST_MESSAGES_NS
from chefbot.msgs.chefbot_msgs import DeliveryStatus

REPOSITORY = Path(__file__).parents[2]


def chefbot(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "chefbot", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)


def demo(cwd: Path, out: str, *arguments: str) -> dict[str, Any]:
    run = chefbot("demo", "--headless", "--out", out, *arguments, cwd=cwd)
    assert run.returncode == 0, run.stdout + run.stderr
    return json.loads((cwd / out / "summary.json").read_text())


def late_compilation(cwd: Path, out: str, *arguments: str) -> list[str]:
    """Run a demo in a process that has compiled all groups of kernels, and return those that it compiles itself."""
    command = [sys.executable, "-m", "tests.kernels.late_compilation", "--headless", "--out", out, *arguments]
    path = {"PYTHONPATH": os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])}
    run = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, env={**os.environ, **path}
    )
    assert run.returncode == 0, run.stdout + run.stderr
    kernels: list[str] = json.loads(run.stdout.splitlines()[-1])
    return kernels


@pytest.mark.rotated("demo in the room")
@pytest.mark.slow
@pytest.mark.parametrize("robot", ["chefbot", "chefbot_lidar"])
def test_demo_in_the_room_maps_localizes_delivers_and_returns(tmp_path: Path, robot: str) -> None:
    """Its replay is bit-identical, and all kernels are compiled ahead."""
    arguments = ("--world", "room", "--robot", robot, "--seed", "2")
    assert late_compilation(tmp_path, "run", *arguments) == []
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["success"]
    assert summary["deliveries_done"] == 2
    assert summary["collisions"] == 0
    assert summary["explored_fraction"] > 0.95
    assert summary["localization_error_m"]["median"] < (0.04 if robot == "chefbot_lidar" else 0.08)
    for name in ("map.yaml", "map.pgm", "map.places.yaml", "report.html", "map_and_plan.png", "run.mcap"):
        assert (tmp_path / "run" / name).stat().st_size > 0
    replay = chefbot("replay", "run/run.mcap", "--check", cwd=tmp_path)
    assert replay.returncode == 0, replay.stdout + replay.stderr


@pytest.mark.rotated("demo in the room")
@pytest.mark.slow
def test_a_second_demo_with_the_same_seed_publishes_the_same(tmp_path: Path) -> None:
    arguments = ("--world", "room", "--robot", "chefbot", "--seed", "2")
    demo(tmp_path, "first", *arguments)
    demo(tmp_path, "second", *arguments)
    first = messages(tmp_path / "first")
    assert len(first) > 1000
    assert first == messages(tmp_path / "second")
    statuses = [one for one in first if one.topic == "delivery_status"]
    end = next(one for one in statuses if DeliveryStatus.from_cdr(one.data).last_outcome)
    after = first[-1].time_ns - end.time_ns
    assert after > LAST_MESSAGES_NS / 2, "the web UI has time to record how the round ended"


@pytest.mark.long
def test_demo_in_the_hotel_delivers_to_three_tables(tmp_path: Path) -> None:
    summary = demo(tmp_path, "run", "--world", "hotel", "--robot", "chefbot_lidar", "--seed", "1")
    assert summary["success"]
    assert summary["deliveries_done"] == 3
    assert summary["collisions"] == 0
    assert summary["explored_fraction"] > 0.95
    assert summary["map_precision"] > 0.95
    assert summary["localization_error_m"]["median"] <= 0.04
    assert (tmp_path / "run" / "run.mcap").stat().st_size < 200_000_000


@pytest.mark.rotated("demo in the room")
@pytest.mark.slow
@pytest.mark.parametrize(("seed", "kind"), [(7, 2), (9, 1), (11, 0)])
def test_a_generated_robot_explores_and_delivers(tmp_path: Path, seed: int, kind: int) -> None:
    """With lidar and camera, a camera alone, and a lidar alone."""
    arguments = (
        "robot",
        "generate",
        "--seed",
        str(seed),
        "--set",
        f"obstacle_sensors={kind}",
        "--out",
        "robot.yaml",
    )
    made = chefbot(*arguments, cwd=tmp_path)
    assert made.returncode == 0, made.stdout + made.stderr
    summary = demo(tmp_path, "run", "--world", "room", "--robot", "robot.yaml", "--seed", "1")
    assert summary["success"]
    assert summary["deliveries_done"] == 2
    assert summary["collisions"] == 0
    assert summary["explored_fraction"] > 0.95
