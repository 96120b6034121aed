"""A launch is replaced by another one on request: which one, with which arguments, and back if it cannot run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.config import ConfigError
from chefbot.devices.state_files import read_state
from chefbot.devices.stored_pose import PoseFile, map_identity, pose_path
from chefbot.errors import ChefbotError, UserError
from chefbot.launcher import launch as launch_module
from chefbot.launcher.launch import LaunchRunner, run_launch
from chefbot.launcher.launch_changer import (
    KIND,
    LAUNCHES,
    NAME,
    accepted_arguments,
    changed_arguments,
    requested_launch,
    with_changer,
    withdraw_request,
)
from chefbot.mapping.image_format import MapFormatError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.launches import LaunchRequest
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.launch import load_launch
from chefbot.storage.map_bundle import MapBundleError
from chefbot.storage.map_files import save_map

GRID = Grid(np.full((20, 30), 100, np.int8), 0.05, 0.0, 0.0)


def running(launch: str = "waiter", **params: Any) -> NodeRunner:
    runner = NodeRunner({NAME: KIND}, {}, {NAME: {"launch": launch, **params}})
    runner.run(2.1)
    return runner


def request(runner: NodeRunner, launch: str, *arguments: str) -> None:
    runner.loop.publish("launch_request", LaunchRequest(launch, arguments), "page")
    runner.run(0.1)


def test_the_running_launch_is_published() -> None:
    *_, status = running("waiter", map_file="hall.yaml").messages("launch_status")
    assert (status.launch, status.mapping, status.map_file) == ("waiter", False, "hall.yaml")
    *_, status = running("gmapping_demo", notice="waiter cannot run").messages("launch_status")
    assert status.mapping and status.notice == "waiter cannot run"


def test_a_request_ends_the_launch() -> None:
    runner = running()
    before = runner.loop.now_ns
    request(runner, "gmapping_demo", "mapper:=graph")
    assert runner.loop.now_ns < before + 100_000_000  # it was stopped before
    found = requested_launch(runner.system)
    assert found is not None and found.launch == "gmapping_demo"
    withdraw_request(runner.system)
    assert requested_launch(runner.system) is None


@pytest.mark.parametrize(
    ("launch", "arguments", "reason"),
    [
        ("keyboard_teleop", (), "'keyboard_teleop' is none of gmapping_demo, explore, amcl_demo, waiter"),
        ("/etc/passwd", (), "is none of"),
        ("waiter", ("map_fil:=x.yaml",), "map_fil"),
        ("waiter", ("x.yaml",), "write key:=value"),
    ],
)
def test_an_unknown_request_changes_nothing(launch: str, arguments: tuple[str, ...], reason: str) -> None:
    runner = running()
    request(runner, launch, *arguments)
    assert requested_launch(runner.system) is None
    assert reason in runner.messages("launch_changer/notice")[-1].data


@pytest.mark.parametrize(
    ("launch", "argument", "map_file"),
    [
        ("waiter", {"map_file": "a/hall.yaml"}, "a/hall.yaml"),
        ("gmapping_demo", {"continue_map": "a/hall.bundle"}, "a/hall.yaml"),
        ("gmapping_demo", {}, ""),
    ],
)
def test_the_map_of_a_launch_is_the_one_it_continues(
    launch: str, argument: dict[str, str], map_file: str
) -> None:
    assert with_changer(load_launch(launch, argument)).nodes[NAME].params["map_file"] == map_file


def test_only_launches_on_a_map_can_be_replaced() -> None:
    for name in LAUNCHES:
        assert NAME in with_changer(load_launch(name)).nodes
    assert NAME not in with_changer(load_launch("3dsensor")).nodes


def test_arguments_of_the_robot_outlive_those_of_the_map() -> None:
    """Also those that the launch between does not have."""
    given = {"robot": "r7.yaml", "port": "8090", "mapper": "graph", "continue_map": "old"}
    given = changed_arguments(given, LaunchRequest("waiter", ("map_file:=new.yaml",)))
    accepted = accepted_arguments("waiter", given)
    assert accepted == {"robot": "r7.yaml", "port": "8090", "map_file": "new.yaml"}
    given = changed_arguments(given, LaunchRequest("gmapping_demo"))
    accepted = accepted_arguments("gmapping_demo", given)
    assert accepted == {"robot": "r7.yaml", "port": "8090", "mapper": "graph"}


def test_a_built_robot_keeps_its_ports() -> None:
    given = {
        "built": "true",
        "robot": "chefbot_lidar",
        "board_port": "/dev/board",
        "lidar_port": "/dev/lidar",
    }
    assert accepted_arguments("waiter", given) == given
    assert accepted_arguments("gmapping_demo", given) == given


@pytest.mark.parametrize(
    ("launch", "built", "kept"), [("explore", True, True), ("explore", False, False), ("waiter", True, False)]
)
def test_a_built_robot_keeps_its_pose_on_the_map_that_it_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, launch: str, built: bool, kept: bool
) -> None:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    path = save_map(tmp_path / "hall", GRID)
    runner = running(launch, built=built)
    transforms = (
        TransformStamped.of(0, "map", "odom", SE2(1.0, 0.0, 0.0)),
        TransformStamped.of(0, "odom", "base_link", SE2(0.5, 0.0, 0.0)),
    )
    runner.loop.publish("tf", TFMessage(transforms), "gmapping")
    runner.run(0.1)
    request(runner, "waiter", f"map_file:={path}")
    stored = read_state(pose_path(runner.system.robot.name), PoseFile)
    assert (stored is not None) == kept
    if stored is not None:
        assert stored.pose == pytest.approx(SE2(1.5, 0.0, 0.0)) and stored.map == map_identity(GRID)


class Runs:
    """Stands for the runs of launches: each ends with the next request, or cannot begin."""

    def __init__(self, *outcomes: LaunchRequest | ChefbotError | None) -> None:
        self.outcomes = list(outcomes)
        self.begun: list[tuple[str, dict[str, str], str]] = []

    def run(
        self, _: LaunchRunner, name: str, arguments: dict[str, str], notice: str = ""
    ) -> LaunchRequest | None:
        self.begun.append((name, arguments, notice))
        outcome = self.outcomes.pop(0)
        if isinstance(outcome, ChefbotError):
            raise outcome
        return outcome


def runs(monkeypatch: pytest.MonkeyPatch, *outcomes: LaunchRequest | ChefbotError | None) -> Runs:
    stand_in = Runs(*outcomes)
    monkeypatch.setattr(
        launch_module.LaunchRunner, "run", lambda *args, **kwargs: stand_in.run(*args, **kwargs)
    )
    return stand_in


def test_a_program_runs_what_is_requested(monkeypatch: pytest.MonkeyPatch) -> None:
    made = runs(
        monkeypatch, LaunchRequest("gmapping_demo"), LaunchRequest("waiter", ("map_file:=b.yaml",)), None
    )
    assert run_launch("waiter", ["robot:=chefbot", "map_file:=a.yaml"]) == 0
    assert [(name, arguments) for name, arguments, _ in made.begun] == [
        ("waiter", {"robot": "chefbot", "map_file": "a.yaml"}),
        ("gmapping_demo", {"robot": "chefbot"}),
        ("waiter", {"robot": "chefbot", "map_file": "b.yaml"}),
    ]


@pytest.mark.parametrize("kind", [UserError, ConfigError, MapBundleError, MapFormatError])
def test_the_launch_before_runs_again_if_the_other_cannot(
    monkeypatch: pytest.MonkeyPatch, kind: type[ChefbotError]
) -> None:
    made = runs(monkeypatch, LaunchRequest("gmapping_demo"), kind("no lidar"), None)
    assert run_launch("waiter", ["map_file:=a.yaml"]) == 0
    assert [name for name, _, _ in made.begun] == ["waiter", "gmapping_demo", "waiter"]
    assert made.begun[-1][1:] == (
        {"map_file": "a.yaml"},
        "Warning: gmapping_demo cannot run, so waiter runs again: no lidar",
    )


def test_a_launch_that_cannot_begin_at_all_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    runs(monkeypatch, UserError("no lidar"))
    with pytest.raises(UserError, match="no lidar"):
        run_launch("waiter", [])
