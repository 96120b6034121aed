"""Tests of the map server: what it publishes, and changes that are written and published at once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.support.nodes import NodeRunner
from tests.support.waiting import wait_for

from chefbot.devices.map_editor import MapEditor
from chefbot.devices.map_file import MAX_WAITING, TOO_MANY
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEdit, MapEditResult, Place
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header
from chefbot.storage.map_files import save_map
from chefbot.storage.places import load_entries, places_path

BAR = Place("bar", PoseStamped(Header(), Pose.of(SE2(2.0, 2.0, 0.0))), label="Café")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    cells = np.zeros((100, 100), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    save_map(tmp_path / "room.yaml", Grid(cells, 0.05, 0.0, 0.0))
    return tmp_path / "room.yaml"


def served(path: Path) -> NodeRunner:
    runner = NodeRunner(
        {"map_file": "chefbot.devices.map_file:MapFileDevice"}, {}, {"map_file": {"map": str(path)}}
    )
    runner.run(0.2)
    return runner


def result_of(runner: NodeRunner, edit: Message) -> MapEditResult:
    """Publish a change and return its result, which comes from a thread."""
    count = len(runner.messages("map_edit_result"))
    runner.loop.publish("map_edit", edit, "page")

    def answered() -> bool:
        runner.run(0.1)
        return len(runner.messages("map_edit_result")) > count

    wait_for(answered)
    result = runner.messages("map_edit_result")[-1]
    assert isinstance(result, MapEditResult)
    return result


def test_a_change_is_written_published_and_taken_back(path: Path) -> None:
    runner = served(path)
    assert runner.messages("map_edit_result")[-1].undoable == 0
    result = result_of(runner, MapEdit("a", places=(BAR,)))
    assert (result.id, result.applied, result.description, result.undoable) == ("a", True, "", 1)
    (place,) = runner.messages("places")[-1].places
    assert (place.name, place.label) == ("bar", "Café")
    assert load_entries(places_path(path))["bar"].label == "Café"
    assert served(path).messages("map_edit_result")[-1].undoable == 1, "changes outlast the launch"
    assert result_of(runner, MapEdit("b", undo=True)).undoable == 0
    assert runner.messages("places")[-1].places == () and not places_path(path).exists()


def test_a_refused_change_is_answered_and_changes_nothing(path: Path) -> None:
    runner = served(path)
    wrong = Place("bar", PoseStamped(Header(), Pose.of(SE2(9.0, 2.0, 0.0))))
    count = len(runner.messages("places"))
    result = result_of(runner, MapEdit("a", places=(wrong,)))
    assert (result.applied, result.description) == (False, "bar lies outside the map")
    preview = result_of(runner, MapEdit("b", places=(BAR,), preview=True))
    assert (preview.applied, preview.description) == (False, "")
    assert len(runner.messages("places")) == count and not places_path(path).exists()


def test_a_flood_of_changes_is_cut_off_and_answered(path: Path) -> None:
    runner = served(path)
    for number in range(100):
        runner.loop.publish("map_edit", MapEdit(str(number), places=(BAR,)), "page")

    def answered() -> bool:
        runner.run(0.1)
        return len(runner.messages("map_edit_result")) > 100

    wait_for(answered)
    results = runner.messages("map_edit_result")[1:]
    assert sorted(result.id for result in results) == sorted(map(str, range(100)))
    applied = [result for result in results if result.applied]
    assert MAX_WAITING <= len(applied) < 100
    assert {result.description for result in results if not result.applied} == {TOO_MANY}
    assert result_of(runner, MapEdit("later", places=(BAR,))).applied


def test_an_unexpected_error_is_not_lost(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runner = served(path)

    def fails(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(MapEditor, "preview", fails)
    result = result_of(runner, MapEdit("a", places=(BAR,)))
    assert not result.applied and "ZeroDivisionError" in result.description
