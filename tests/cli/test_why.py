"""`chefbot why` on logs of runs: lines, JSON, a picture, and one sentence for what is not the log of a run."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from chefbot.causes.history import CauseSpan
from chefbot.causes.reports import END, STOP
from chefbot.cli.why import picture, reasons
from chefbot.cli.why.commands import why
from chefbot.cli.why.picture import MARGIN, write_picture
from chefbot.cli.why.reasons import print_reasons
from chefbot.cli.why.run_log import RunCauses, find_log
from chefbot.errors import UserError
from chefbot.maths.grid import Grid
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs import Cause, Quantity
from chefbot.msgs.geometry_msgs import Point, Pose
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.ros2.bag.writer import BagWriter
from chefbot.ros2.rmw.names import InterfaceType
from chefbot.runtime.loop import Publication
from chefbot.runtime.recorder import Recorder

SECOND = 1_000_000_000


def cause(number: int, seconds: float, kind: str = STOP) -> Cause:
    return Cause(
        Header.of(round(seconds * SECOND), "map"),
        number,
        kind,
        "controller",
        "twists",
        "lidar",
        True,
        Point(1.5, 2.0, 0.0),
        Time.of(round((seconds - 0.5) * SECOND)),
        "not on the map",
        -1,
        Pose(),
        0,
        ("controller: twists", "lidar: x 1.50 m"),
        (Quantity("speed", 0.1, "m/s"),),
        f"Sentence {number}.",
    )


def write_log(path: Path, messages: list[tuple[str, Message]]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    recorder = Recorder(path, load_robot("chefbot_lidar"), 1)
    for count, (topic, message) in enumerate(messages):
        recorder(Publication(topic, message, "test", False, (count + 1) * SECOND, False))
    recorder.close()
    return path


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run of 1 s to 40 s with 30 causes, each of which lasts half a second, and a map."""
    cells = np.full((60, 80), -1, np.int8)
    cells[5:50, 5:70] = 0
    grid = OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, 0.0, 0.0))
    causes: list[tuple[str, Message]] = []
    for number in range(1, 31):
        causes += [("causes", cause(number, number)), ("causes", cause(number, number + 0.5, END))]
    return write_log(tmp_path / "run" / "run.mcap", [("map", grid), *causes]).parent


def test_the_newest_causes_are_lines(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    print_reasons(run, 20, False, None)
    head, hidden, *lines = capsys.readouterr().out.splitlines()
    assert head == f"{run / 'run.mcap'}: 30 stops"
    assert hidden == "(10 earlier causes; --all shows them)" and len(lines) == 20
    assert lines[-1].split() == ["30", "29.0", "s", "Stopped", "0.5", "s", "Sentence", "30."]
    print_reasons(run / "run.mcap", None, False, None)
    assert len(capsys.readouterr().out.splitlines()) == 31


def write_bag(path: Path, causes: list[Cause]) -> Path:
    """A bag on wall time of a robot with simulated time, as `chefbot bag record` writes it."""
    kind, began_ns = InterfaceType.of(Cause), 1_795_733_071 * SECOND
    writer = BagWriter(path)
    writer.add_topic("/causes", kind, [])
    for number, one in enumerate(causes):
        received_ns = began_ns + number * SECOND
        writer.add("/causes", kind, one.to_cdr(), received_ns, received_ns)
    writer.close()
    return path


def test_a_bag_of_two_launches_shows_the_robots_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = write_bag(tmp_path / "two.mcap", [cause(1, 5.0), cause(2, 9.0), cause(1, 3.0)])
    print_reasons(bag, None, False, None)
    _, first, second, restart, third = capsys.readouterr().out.splitlines()
    assert [line.split()[:3] for line in (first, second, third)] == [
        ["1", "5.0", "s"],
        ["2", "9.0", "s"],
        ["3", "3.0", "s"],
    ]
    assert restart == "The robot was started again."


def test_the_chain_is_data(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    print_reasons(run, 1, True, None)
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line) == {
        "id": 30,
        "time": 30.0,
        "ended": 30.5,
        "kind": "stop",
        "node": "controller",
        "check": "twists",
        "place": {"frame": "map", "x": 1.5, "y": 2.0},
        "sensor": "lidar",
        "marked_at": 29.5,
        "obstacle": "not on the map",
        "person": None,
        "caused_by": None,
        "chain": ["controller: twists", "lidar: x 1.50 m"],
        "numbers": {"speed": {"value": 0.1, "unit": "m/s"}},
        "sentence": "Sentence 30.",
    }


def test_the_picture_is_a_png(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "pictures" / "why.png"
    print_reasons(run, 20, False, picture)
    assert picture.read_bytes().startswith(b"\x89PNG") and str(picture) in capsys.readouterr().out
    with pytest.raises(UserError, match=r"ends in \.png"):
        print_reasons(run, 20, False, tmp_path / "why.svg")


def test_without_a_run_the_newest_log_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match="there is no log in runs/"):
        find_log(None)
    logs = [
        write_log(tmp_path / "runs" / name / "run.mcap", [("causes", cause(1, 1))]) for name in ("b", "a")
    ]
    for age, log in enumerate(logs):
        os.utime(log, (100 + age, 100 + age))
    assert find_log(None) == Path("runs/a/run.mcap")


def test_a_log_that_ends_too_early_is_read_up_to_there(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = run / "run.mcap"
    content = log.read_bytes()
    log.write_bytes(content[: len(content) - 3000])
    print_reasons(run, 20, False, None)
    out = capsys.readouterr().out
    assert "30 stops" in out and "The log is not complete: " in out


@pytest.mark.parametrize("length", [0, 5, 300, 1000])
def test_a_log_cut_in_its_first_chunk_is_reported_in_a_sentence(run: Path, length: int) -> None:
    log = run / "run.mcap"
    log.write_bytes(log.read_bytes()[:length])
    with pytest.raises(UserError, match=r"run\.mcap"):
        print_reasons(run, 20, False, None)


def test_what_is_not_a_run_is_reported_in_a_sentence(tmp_path: Path) -> None:
    text = tmp_path / "notes.txt"
    text.write_text("nothing\n" * 100)
    empty = write_log(tmp_path / "empty" / "run.mcap", [("phase", String("Idle."))])
    foreign = write_log(tmp_path / "foreign" / "run.mcap", [("causes", String("no cause"))])
    for path, sentence in [
        (tmp_path / "nothing", "there is no run"),
        (tmp_path, "has no log"),
        (text, "is not an MCAP file"),
        (empty, "holds no causes"),
        (foreign, "carries std_msgs/msg/String, not chefbot_msgs/msg/Cause"),
    ]:
        with pytest.raises(UserError, match=sentence):
            print_reasons(path, 20, False, None)


def test_without_places_there_is_no_picture(tmp_path: Path) -> None:
    unplaced = Cause(Header.of(SECOND, ""), 1, STOP, sentence="No map yet.")
    log = write_log(tmp_path / "run.mcap", [("causes", unplaced)])
    with pytest.raises(UserError, match="no causes with a place on a map"):
        print_reasons(log, 20, False, tmp_path / "why.png")


class Drawn:
    """The axes of the picture that is drawn."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        frame = picture._frame
        self.axes: Any = None

        def keep(axes: Any, *arguments: Any) -> None:
            self.axes = axes
            frame(axes, *arguments)

        monkeypatch.setattr(picture, "_frame", keep)

    @property
    def limits(self) -> tuple[float, ...]:
        return (*self.axes.get_xlim(), *self.axes.get_ylim())


def placed(number: int, robot: tuple[float, float], obstacle: tuple[float, float] | None) -> CauseSpan:
    at = Pose(Point(*robot))
    one = msgspec.structs.replace(cause(number, number), robot=at, located=obstacle is not None)
    return CauseSpan(msgspec.structs.replace(one, point=Point(*(obstacle or (99.0, 99.0)))), None)


SPANS = [placed(1, (1.0, 2.0), (2.0, 5.0)), placed(2, (-3.0, 0.5), None)]


def test_the_picture_shows_all_places_with_a_margin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn(monkeypatch)
    write_picture(tmp_path / "a.png", RunCauses(Path("run"), SPANS, None, 0, ""), SPANS)
    assert drawn.limits == pytest.approx((-3.0 - MARGIN, 2.0 + MARGIN, 0.5 - MARGIN, 5.0 + MARGIN))
    labels = [text.get_text() for text in drawn.axes.texts]
    assert labels == ["1", "2"], "the numbers of the causes, where the robot was"


def test_the_picture_shows_what_the_map_knows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = Drawn(monkeypatch)
    cells = np.full((100, 200), -1, np.int8)
    cells[20:60, 10:190] = 0
    grid = Grid(cells, 0.1, -5.0, -2.0)
    write_picture(tmp_path / "a.png", RunCauses(Path("run"), SPANS, grid, 0, ""), SPANS)
    expected = (-4.0 - MARGIN, 14.0 + MARGIN, 0.0 - MARGIN, 5.0 + MARGIN)
    assert drawn.limits == pytest.approx(expected), "known cells, and the obstacle above them"
    (image,) = drawn.axes.get_images()
    assert tuple(image.get_extent()) == pytest.approx((-5.0, 15.0, -2.0, 8.0))
    unknown = Grid(np.full((10, 10), -1, np.int8), 0.1, 50.0, 50.0)
    write_picture(tmp_path / "a.png", RunCauses(Path("run"), SPANS, unknown, 0, ""), SPANS)
    assert drawn.limits[1] == pytest.approx(2.0 + MARGIN), "an unknown map shows nothing"


def test_options_select_the_printed_causes(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[tuple[object, ...]] = []
    monkeypatch.setattr(reasons, "print_reasons", lambda *arguments: calls.append(arguments))
    why(Path("run"), 5, False, True, None)
    why(None, 20, True, False, Path("a.png"))
    assert calls == [(Path("run"), 5, True, None), (None, None, False, Path("a.png"))]
