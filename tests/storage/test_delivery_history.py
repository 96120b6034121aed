"""The history of deliveries: what is written is read, whatever ends the writer, and older files are brought up."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.waiting import wait_for

from chefbot.storage import history_file
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.delivery_history import DeliveryHistory, read_history

PLACES = ("table_1", "table_2")
WRITER = """
import sys
from pathlib import Path
from chefbot.storage.delivery_history import DeliveryHistory
history = DeliveryHistory(Path(sys.argv[1]))
for number in range(10**6):
    row = history.begin(str(number), "anna", ("table_1", "table_2"), simulated=False)
    history.note_loaded(row)
    history.note_stop(row, "table_1", "taken")
    history.note_stop(row, "table_2", "taken")
    history.end(row, f"round {number}")
    print(number, flush=True)
"""


@pytest.fixture
def history(tmp_path: Path) -> DeliveryHistory:
    return DeliveryHistory(tmp_path / "robots" / "one.sqlite")


def test_a_round_is_read_as_it_was_noted(history: DeliveryHistory) -> None:
    number = history.begin("page 1", "anna", ("table_1", "table_2", "table_1"), simulated=True)
    history.note_loaded(number)
    (half,) = history.rounds(5)
    assert half.loaded and half.ended is None and [stop.outcome for stop in half.stops] == ["", "", ""]
    for place, outcome in (
        ("table_1", "taken"),
        ("table_2", "no path"),
        ("table_1", "nobody"),
        ("table_9", "x"),
    ):
        history.note_stop(number, place, outcome)
    history.end(number, "At home.")
    history.end(number, "later")
    history.close()
    (read,) = read_history(history.path, 5)
    assert (read.ordered_by, read.simulated, read.outcome) == ("anna", True, "At home.")
    assert [(stop.place, stop.outcome) for stop in read.stops] == [
        ("table_1", "taken"),
        ("table_2", "no path"),
        ("table_1", "nobody"),
    ]
    assert read.ended and read.ended.endswith("+00:00") and all(stop.at for stop in read.stops)


@given(st.integers(1, 6), st.integers(0, 6))
def test_the_newest_rounds_are_read_the_oldest_first(
    tmp_path_factory: pytest.TempPathFactory, last: int, count: int
) -> None:
    history = DeliveryHistory(tmp_path_factory.mktemp("history") / "one.sqlite")
    for number in range(count):
        history.end(history.begin("", "", PLACES, simulated=False), str(number))
    names = [one.outcome for one in history.rounds(last)]
    assert names == [str(number) for number in range(max(0, count - last), count)]
    history.close()


def test_only_the_newest_open_round_of_an_order_goes_on(history: DeliveryHistory) -> None:
    assert history.open_round("a", PLACES) is None
    number = history.begin("a", "", PLACES, simulated=False)
    assert history.open_round("a", PLACES) == number
    assert history.open_round("b", PLACES) is None and history.open_round("a", PLACES[:1]) is None
    history.end(number, "done")
    assert history.open_round("a", PLACES) is None


@pytest.mark.slow
@pytest.mark.parametrize("rounds", [1, 3, 8])
def test_a_killed_writer_leaves_a_whole_history(tmp_path: Path, rounds: int) -> None:
    path = tmp_path / "one.sqlite"
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
    ) as writer:
        assert writer.stdout is not None
        for _ in range(rounds):
            last = int(writer.stdout.readline())
        time.sleep(0.003 * rounds)  # somewhere in the next round
        writer.kill()
    read = read_history(path, 10**6)
    assert len(read) > last
    for one in read[:-1]:
        assert one.ended and [stop.outcome for stop in one.stops] == ["taken", "taken"]
    assert sqlite3.connect(path).execute("PRAGMA integrity_check").fetchone() == ("ok",)


def test_several_processes_may_open_a_new_file(tmp_path: Path) -> None:
    path = tmp_path / "one.sqlite"
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE) for _ in range(3)
    ]
    for writer in writers:
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"0\n"
        writer.kill()
        writer.communicate()
    wait_for(lambda: len(read_history(path, 10)) >= 3)


def test_an_older_file_is_brought_to_the_newest_version(
    history: DeliveryHistory, monkeypatch: pytest.MonkeyPatch
) -> None:
    history.end(history.begin("", "anna", PLACES, simulated=False), "kept")
    history.close()
    more = "ALTER TABLE rounds ADD COLUMN tray TEXT"
    monkeypatch.setattr(history_file, "MIGRATIONS", (*history_file.MIGRATIONS, more))
    assert [one.outcome for one in read_history(history.path, 5)] == ["kept"]
    columns = sqlite3.connect(history.path).execute("PRAGMA table_info(rounds)").fetchall()
    assert "tray" in [column[1] for column in columns]
    monkeypatch.undo()
    with pytest.raises(StorageError, match="of a newer version"):
        DeliveryHistory(history.path)
    assert sqlite3.connect(history.path).execute("PRAGMA user_version").fetchone() == (
        len(history_file.MIGRATIONS) + 1,
    )


@pytest.mark.parametrize("content", [b"not a database" * 100, b"SQLite format 3\0" + b"\xff" * 4000])
def test_a_damaged_file_has_one_sentence_and_stays(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "one.sqlite"
    path.write_bytes(content)
    with pytest.raises(StorageError, match=r"^the history .*one\.sqlite cannot be used: "):
        DeliveryHistory(path)
    assert path.read_bytes() == content


def test_a_folder_in_the_way_is_reported_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError):
        DeliveryHistory(tmp_path / "file" / "one.sqlite")
    (tmp_path / "one.sqlite").mkdir()
    with pytest.raises(StorageError, match="cannot be used"):
        DeliveryHistory(tmp_path / "one.sqlite")


def test_only_the_owner_may_read_it(history: DeliveryHistory) -> None:
    history.begin("a", "anna", PLACES, simulated=False)
    assert {path.stat().st_mode & 0o077 for path in history.path.parent.iterdir()} == {0}


def test_without_an_id_no_old_round_goes_on(tmp_path: Path) -> None:
    history = DeliveryHistory(tmp_path / "one.sqlite")
    first = history.begin("", "", ("table_1",), simulated=False)
    assert history.open_round("", ("table_1",)) == first
    named = history.begin("a", "anna", ("table_2",), simulated=False)
    assert history.open_round("", ("table_1",)) is None
    history.begin("b", "ben", ("table_3",), simulated=False)
    assert history.open_round("a", ("table_2",)) == named
