"""The web UI's device records causes over all runs, with pictures; a damaged history is a notice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.causes.reports import DETOUR, EMERGENCY_STOP, END, FAILURE, SLOW, STOP
from chefbot.maths.grid import Grid
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import NoParams
from chefbot.storage.cause_records import CauseRecords, read_causes
from chefbot.ui.causes.cause_recorder import PICTURE_INTERVAL_NS, REPEAT_NS
from chefbot.ui.causes.cause_views import SHOWN_CAUSES
from chefbot.ui.display.views import CauseView
from chefbot.ui.missions.cause_device import CauseDevice
from chefbot.ui.missions.history_device import history_path

GRID = Grid(np.zeros((40, 40), np.int8), 0.1, -2.0, -2.0)
PICTURE = Image(Header(), 24, 32, "rgb8", 0, 96, np.zeros(24 * 96, np.uint8))


class Keeper(CauseDevice):
    """The base class alone."""

    params: NoParams


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], NodeRunner]]:
    """The function that starts the device, in each run with the same history."""
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    started: list[NodeRunner] = []

    def start() -> NodeRunner:
        while started:
            started.pop().system.stop()
        started.append(NodeRunner({"page": f"{__name__}:Keeper"}, {}))
        device(started[0])._open_causes(simulated=True)
        return started[0]

    yield start
    while started:
        started.pop().system.stop()


def device(nodes: NodeRunner) -> Any:
    return nodes.system.nodes["page"]


def cause(number: int, kind: str, second: float, frame: str = "map") -> Cause:
    header = Header.of(round(second * 1e9), frame)
    return Cause(
        header,
        number,
        kind,
        located=True,
        point=Point(1.0, 0.5),
        sentence=f"Cause {number}.",
        chain=("a", "b"),
    )


def process(nodes: NodeRunner, one: Cause) -> tuple[CauseView, ...]:
    views: tuple[CauseView, ...] = device(nodes)._process_cause(one, GRID, PICTURE)
    return views


def recorded(nodes: NodeRunner) -> list[tuple[str, float | None, tuple[str, ...]]]:
    causes = read_causes(history_path(device(nodes).robot.name), 50)
    return [(one.sentence, one.duration, one.pictures) for one in reversed(causes)]


def test_stops_and_failures_have_pictures(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    for number, kind in enumerate((SLOW, STOP, DETOUR, FAILURE), 1):
        process(nodes, cause(number, kind, 10.0 * number))
    (failure, *_) = process(nodes, cause(2, END, 50.0))
    assert failure.pictures == ("map", "camera")
    assert recorded(nodes) == [
        ("Cause 1.", None, ()),
        ("Cause 2.", 30.0, ("map", "camera")),
        ("Cause 3.", None, ()),
        ("Cause 4.", None, ("map", "camera")),
    ]
    records = CauseRecords(history_path(device(nodes).robot.name))
    assert (records.picture(failure.number, "map") or b"").startswith(b"\x89PNG")
    assert (records.picture(failure.number, "camera") or b"").startswith(b"\xff\xd8")


def test_pictures_are_taken_once_a_second(make: Callable[[], NodeRunner]) -> None:
    nodes, interval = make(), PICTURE_INTERVAL_NS / 1e9
    seconds = (
        10.0,
        10.0 + 0.5 * interval,
        10.0 + 1.1 * interval,
        3.0,
    )  # the clock of a simulation begins again
    for number, second in enumerate(seconds, 1):
        process(nodes, cause(number, STOP, second))
    assert [bool(pictures) for *_, pictures in recorded(nodes)] == [True, False, True, True]


def test_a_cause_that_repeats_is_one_entry(make: Callable[[], NodeRunner]) -> None:
    nodes, repeat = make(), REPEAT_NS / 1e9
    for number, second in enumerate((10.0, 20.0, 30.0), 1):
        same = msgspec.structs.replace(cause(number, STOP, second), sentence="Lost.")
        process(nodes, same)
        views = process(
            nodes,
            msgspec.structs.replace(same, kind=END, header=Header.of(round(second * 1e9) + 10**9, "map")),
        )
    assert [(one.id, one.sentence) for one in views] == [(3, "Lost.")]
    assert recorded(nodes) == [("Lost.", 3.0, ("map", "camera"))], "without the pauses, in which it drove"
    process(nodes, msgspec.structs.replace(cause(4, STOP, 30.0 + repeat), sentence="Lost."))
    assert len(recorded(nodes)) == 2


def test_each_emergency_stop_is_an_entry(make: Callable[[], NodeRunner]) -> None:
    """Two presses within a minute are two events for whoever asks what happened."""
    nodes = make()
    for number, second in enumerate((10.0, 20.0), 1):
        stop = msgspec.structs.replace(cause(number, STOP, second), check=EMERGENCY_STOP, sentence="Stopped.")
        views = process(nodes, stop)
    assert len(views) == len(recorded(nodes)) == 2


def test_causes_of_a_full_disk_are_recorded_later(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    page = device(nodes)
    process(nodes, cause(1, STOP, 1.0))
    (pages,) = page._records._db.execute("PRAGMA page_count").fetchone()
    page._records._db.execute(f"PRAGMA max_page_count = {pages}")
    for number in range(2, 40):
        process(nodes, cause(number, STOP, 10.0 * number))
    nodes.run(0.5)
    assert len(recorded(nodes)) < 39 and page.own_warnings
    page._records._db.execute("PRAGMA max_page_count = 1000000")
    nodes.run(6.0)
    assert len(recorded(nodes)) == 39 and page.own_warnings == []
    assert [one for one in recorded(nodes) if not one[2]] == []


def test_causes_that_take_turns_are_an_entry_each(make: Callable[[], NodeRunner]) -> None:
    """A goal without a path and the recoveries after it would push all others out of the list."""
    nodes = make()
    for number in range(1, 13):
        sentence = "No path." if number % 2 else f"Recovery {number // 2}: no path."
        views = process(nodes, msgspec.structs.replace(cause(number, STOP, 2.0 * number), sentence=sentence))
    assert len(views) == len(recorded(nodes)) == 2


def test_earlier_runs_fill_the_list_up(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    for number in range(1, 4):
        process(nodes, cause(number, STOP, 10.0 * number))
    nodes = make()
    for number in range(1, SHOWN_CAUSES):
        views = process(nodes, cause(number, DETOUR, 10.0 * number))
    assert [one.began == "" for one in views] == [True] * (SHOWN_CAUSES - 1) + [False]
    assert len(process(nodes, cause(SHOWN_CAUSES, DETOUR, 999.0))) == SHOWN_CAUSES


def test_causes_that_repeat_displace_no_others(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    process(nodes, cause(1, STOP, 10.0))
    for number in range(2, 2 * SHOWN_CAUSES):
        again = msgspec.structs.replace(cause(number, STOP, 10.0 + number), sentence="Lost.")
        views = process(nodes, again)
    assert len(views) == 2 and views[1].id == 1


def test_a_stop_is_recorded_without_map_or_camera(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    process(nodes, cause(1, STOP, 1.0, frame="odom"))
    device(nodes)._process_cause(cause(2, STOP, 3.0), None, None)
    unknown = Image(Header(), 1, 1, "bayer_rggb8", 0, 1, np.zeros(1, np.uint8))
    device(nodes)._process_cause(cause(3, STOP, 5.0), GRID, unknown)
    assert [pictures for *_, pictures in recorded(nodes)] == [("camera",), (), ("map",)]


def test_the_next_run_shows_the_causes_of_the_last(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    process(nodes, cause(1, STOP, 10.0))
    process(nodes, cause(1, END, 12.0))
    process(nodes, cause(2, FAILURE, 20.0))
    nodes = make()
    new, failure, stop = process(nodes, cause(1, STOP, 1.0))
    assert (new.sentence, new.began, new.ended) == ("Cause 1.", "", None)
    assert [(one.sentence, one.ended, one.time) for one in (failure, stop)] == [
        ("Cause 2.", 0.0, 0.0),
        ("Cause 1.", 2.0, 0.0),
    ]
    assert failure.began and failure.pictures == ("map", "camera")
    assert len({one.number for one in (new, failure, stop)}) == 3


def test_a_damaged_history_is_a_notice_and_causes_are_shown(make: Callable[[], NodeRunner]) -> None:
    nodes = make()
    path = history_path(device(nodes).robot.name)
    nodes.system.stop()
    path.write_bytes(b"not a database" * 100)
    for extra in path.parent.glob("*.sqlite-*"):
        extra.unlink()
    nodes = make()
    (view,) = process(nodes, cause(1, STOP, 1.0))
    assert (view.number, view.pictures) == (0, ())
    nodes.run(1.0)
    (notice,) = nodes.messages("page/notice")
    assert "cannot be used" in notice.data
    assert device(nodes).own_warnings == [notice.data.removeprefix("Warning: ").removesuffix(".")]
