"""Tests of the recorded causes: what is noted is read again, the oldest are forgotten, older files are kept."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.storage import cause_records, history_file
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.cause_records import CauseRecords, Moment, read_causes
from chefbot.storage.delivery_history import DeliveryHistory, RecordedStop, read_history

TEXTS = st.text(st.characters(codec="utf-8"), max_size=30)
PLACES = st.none() | st.floats(-1e6, 1e6)


@pytest.fixture
def records(tmp_path: Path) -> CauseRecords:
    return CauseRecords(tmp_path / "robots" / "one.sqlite")


@given(
    moment=st.builds(
        Moment, effect=TEXTS, sentence=TEXTS, chain=st.lists(TEXTS, max_size=3).map(tuple), x=PLACES, y=PLACES,
        map=st.binary(max_size=20), camera=st.binary(max_size=20),
    ),
    simulated=st.booleans(),
)  # fmt: skip
def test_a_cause_is_read_as_it_was_noted(
    tmp_path_factory: pytest.TempPathFactory, moment: Moment, simulated: bool
) -> None:
    records = CauseRecords(tmp_path_factory.mktemp("history") / "one.sqlite")
    number = records.add(moment, simulated=simulated)
    (read,) = read_causes(records.path, 5)
    assert (read.effect, read.sentence, read.chain) == (moment.effect, moment.sentence, moment.chain)
    assert (read.x, read.y, read.simulated, read.duration) == (moment.x, moment.y, simulated, None)
    assert read.pictures == moment.pictures
    assert records.picture(number, "map") == (moment.map or None)
    assert records.picture(number, "camera") == (moment.camera or None)
    assert records.picture(number + 1, "map") is None


def test_an_end_has_the_duration_of_its_cause(records: CauseRecords) -> None:
    first, second = (
        records.add(Moment(effect="Stopped", sentence=name), simulated=False) for name in ("a", "b")
    )
    records.end(first, 2.5)
    records.end(second + 1, 9.0)
    assert [(cause.number, cause.duration) for cause in records.causes(5)] == [(second, None), (first, 2.5)]


def test_the_oldest_causes_are_forgotten(records: CauseRecords, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cause_records, "MAX_KEPT", 3)
    for number in range(5):
        records.add(Moment(effect="Stopped", sentence=str(number)), simulated=False)
    assert [cause.sentence for cause in records.causes(10)] == ["4", "3", "2"]


def test_a_file_of_deliveries_keeps_them_and_gets_causes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "one.sqlite"
    monkeypatch.setattr(history_file, "MIGRATIONS", history_file.MIGRATIONS[:1])
    DeliveryHistory(path).close()
    with closing(sqlite3.connect(path)) as old:
        old.execute("INSERT INTO rounds VALUES (1, 'a', 'anna', 0, '2026-01-01', NULL, '2026-01-01', 'kept')")
        old.execute("INSERT INTO stops VALUES (1, 0, 'table_1', 'taken', '2026-01-01')")
        old.commit()
    monkeypatch.undo()
    assert read_causes(path, 5) == []
    [one] = read_history(path, 5)
    assert one.outcome == "kept" and one.stops == (RecordedStop("table_1", "taken", "2026-01-01"),)
    assert sqlite3.connect(path).execute("PRAGMA user_version").fetchone() == (len(history_file.MIGRATIONS),)


def test_two_connections_write_in_turn(records: CauseRecords) -> None:
    history = DeliveryHistory(records.path)
    for number in range(20):
        records.add(Moment(effect="Stopped", sentence=str(number)), simulated=True)
        history.begin(str(number), "anna", ("table_1",), simulated=True)
    assert (len(records.causes(50)), len(history.rounds(50))) == (20, 20)


def test_a_damaged_file_is_reported_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "one.sqlite"
    path.write_bytes(b"not a database" * 100)
    with pytest.raises(StorageError, match="cannot be used"):
        read_causes(path, 1)
