"""`chefbot map slam`: all results of a log, or none."""

from __future__ import annotations

import errno
import math
import os
from pathlib import Path

import pytest

from chefbot.cli.map import slam
from chefbot.cli.map.slam import run_slam
from chefbot.errors import ChefbotError, UserError
from chefbot.storage.atomic_files import StorageError

RESULTS = ["map.bundle", "map.pgm", "map.png", "map.yaml", "trajectory.tum"]
BEAMS = 180


def log_of_a_round_room(path: Path, turns: int = 3) -> Path:
    """The robot turns in the middle of a round room of 2 m radius, 0.6 rad a scan."""
    lines = []
    for turn in range(turns):
        pose = f"0 0 {0.6 * turn:g}"
        lines.append(f"FLASER {BEAMS} {'2.0 ' * BEAMS}{pose} {pose} {turn} host {turn}")
    path.write_text("\n".join(lines))
    return path


def mapped(folder: Path) -> Path:
    log = log_of_a_round_room(folder / "room.log")
    run_slam(log, folder / "out", "gmapping", particles=2, seed=1, max_range=10.0)
    return folder / "out"


def test_the_results_lie_in_the_folder(tmp_path: Path) -> None:
    out = mapped(tmp_path)
    assert sorted(path.name for path in out.iterdir()) == RESULTS
    assert len((out / "trajectory.tum").read_text().splitlines()) == 3


@pytest.mark.rotated
@pytest.mark.parametrize("algorithm", ["gmapping", "graph"])
def test_a_report_has_figures_and_pictures(algorithm: str, tmp_path: Path) -> None:
    log = log_of_a_round_room(tmp_path / "<room>.log", turns=9)
    run_slam(log, tmp_path / "out", algorithm, particles=2, seed=1, max_range=10.0, report=True)
    report = (tmp_path / "out" / "report.html").read_text()
    assert "&lt;room&gt;.log" in report and "<room>" not in report
    assert "9, 9 of them used" in report and report.count("data:image/png;base64,") >= 3


def test_a_log_that_does_not_exist_is_named_once(tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match="does not exist") as error:
        run_slam(tmp_path / "none.log", tmp_path / "out", "gmapping", particles=2, seed=1, max_range=10.0)
    assert str(error.value).count("none.log") == 1


@pytest.mark.parametrize("write", range(7))
def test_a_full_disk_leaves_all_old_results(
    write: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = mapped(tmp_path)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    syncs, sync = iter(range(100)), os.fsync

    def full(handle: int) -> None:
        if next(syncs) == write:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        sync(handle)

    monkeypatch.setattr(os, "fsync", full)
    log = log_of_a_round_room(tmp_path / "longer.log", turns=5)
    with pytest.raises(StorageError, match="No space left on device"):
        run_slam(log, out, "gmapping", particles=2, seed=1, max_range=10.0)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("ODOM 0 0 0 0 0 0 0 host 0", r"room\.log: the log holds no FLASER line"),
        ("FLASER 2 1 1 0", r"room\.log: the log holds no FLASER line"),
        ("FLASER 2 1 1 0 0 0 9e9 0 0 0 host 0\n", r"room\.log: line 1 of the CARMEN log"),
    ],
)
def test_a_log_that_cannot_be_mapped_is_reported_in_one_sentence(
    text: str, sentence: str, tmp_path: Path
) -> None:
    (tmp_path / "room.log").write_text(text)
    with pytest.raises(UserError, match=sentence) as caught:
        run_slam(
            tmp_path / "room.log", tmp_path / "new/out", "gmapping", particles=2, seed=1, max_range=math.inf
        )
    assert isinstance(caught.value, ChefbotError) and not (tmp_path / "new").exists()


def test_a_folder_that_cannot_be_made_is_reported_before_mapping(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def mapped_first(*_: object) -> None:
        pytest.fail("the log was mapped first")

    monkeypatch.setattr(slam, "run_log", mapped_first)
    (tmp_path / "out").write_text("")
    log = log_of_a_round_room(tmp_path / "room.log")
    with pytest.raises(StorageError, match=r"out cannot be made"):
        run_slam(log, tmp_path / "out", "gmapping", particles=2, seed=1, max_range=10.0)
    assert (tmp_path / "out").is_file()


def test_a_bad_log_leaves_an_empty_folder_that_was_there(tmp_path: Path) -> None:
    (tmp_path / "room.log").write_text("")
    (tmp_path / "out").mkdir()
    with pytest.raises(UserError, match="no FLASER line"):
        run_slam(tmp_path / "room.log", tmp_path / "out", "graph", particles=2, seed=1, max_range=10.0)
    assert (tmp_path / "out").is_dir()


def test_one_scan_is_counted_in_the_singular(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = log_of_a_round_room(tmp_path / "room.log", turns=1)
    run_slam(log, tmp_path / "out", "gmapping", particles=2, seed=1, max_range=10.0)
    assert "1 scan, " in capsys.readouterr().out
