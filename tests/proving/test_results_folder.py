"""The folder of a proof: records round trip, a damaged one is made again, tables are read by PyArrow."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.proving_runs import a_record, tiny

from chefbot.errors import UserError
from chefbot.proving.record import GoalRecord, RunRecord, machine
from chefbot.proving.results_folder import (
    GOALS_TABLE,
    RECORDS,
    REQUEST,
    RUNS_TABLE,
    Request,
    ResultsFolder,
    write_tables,
)
from chefbot.storage.atomic_files import StorageError

REQUESTED = Request(scenarios=[tiny()], folders=["."], seeds=[[1, 2, 3]])


def created(tmp_path: Path) -> ResultsFolder:
    results = ResultsFolder(tmp_path / "results")
    results.create(REQUESTED)
    return results


NUMBERS = st.floats(-1e6, 1e6)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=20)
ANY_RECORD = st.builds(
    RunRecord,
    key=st.from_regex("[0-9a-f]{20}", fullmatch=True),
    scenario=st.just("tiny"),
    seed=st.integers(0, 2**31),
    success=st.booleans(),
    failure=TEXTS,
    figures=st.dictionaries(st.sampled_from(["time", "collisions"]), NUMBERS),
    goals=st.lists(
        st.builds(
            GoalRecord,
            place=TEXTS,
            began=NUMBERS,
            ended=NUMBERS,
            reached=st.booleans(),
            distance=NUMBERS,
            reason=TEXTS,
        ),
        max_size=3,
    ),
    path=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), max_size=3),
    incidents=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, TEXTS), max_size=3),
    plan=st.binary(max_size=50),
    messages=st.from_regex("[0-9a-f]{32}", fullmatch=True),
    machine=st.dictionaries(TEXTS, TEXTS, max_size=2),
)


@given(ANY_RECORD)
def test_records_round_trip(tmp_path_factory: pytest.TempPathFactory, record: RunRecord) -> None:
    results = ResultsFolder(tmp_path_factory.mktemp("results"))
    (results.folder / RECORDS).mkdir()
    results.add(record)
    assert results.find(record.key) == record
    assert results.records() == [record]


def test_a_log_is_kept_beside_its_record(tmp_path: Path) -> None:
    results = created(tmp_path)
    results.add(a_record(1), b"log")
    results.add(a_record(2))
    assert results.log_path(a_record(1)).read_bytes() == b"log"
    assert not results.log_path(a_record(2)).exists()


def test_the_request_is_read_back(tmp_path: Path) -> None:
    assert created(tmp_path).request() == REQUESTED


@pytest.mark.parametrize("content", [b"", b"{}", b"[1", b"\xff\xfe"])
def test_a_damaged_request_is_reported_in_one_sentence(tmp_path: Path, content: bytes) -> None:
    results = created(tmp_path)
    (results.folder / REQUEST).write_bytes(content)
    with pytest.raises(UserError, match=r"request.json is damaged"):
        results.request()


def test_a_folder_without_a_proof_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"holds no results to resume: request.json is missing"):
        ResultsFolder(tmp_path).request()
    with pytest.raises(UserError, match=r"holds no results of runs"):
        ResultsFolder(tmp_path).records()


@pytest.mark.parametrize("content", [b"", b"{}", b'{"key": "tiny1"', b"\x00" * 100])
def test_a_damaged_record_counts_as_not_made(tmp_path: Path, content: bytes) -> None:
    results = created(tmp_path)
    for seed in (1, 2):
        results.add(a_record(seed))
    (results.folder / RECORDS / "tiny1.json").write_bytes(content)
    assert results.find("tiny1") is None
    assert [record.seed for record in results.records()] == [2]


def test_of_two_records_of_a_seed_the_newer_counts(tmp_path: Path) -> None:
    results = created(tmp_path)
    for number, key in enumerate(("b", "a")):  # the newer one has the smaller name
        results.add(a_record(1, key=key))
        os.utime(results.folder / RECORDS / f"{key}.json", ns=(number, number))
    assert [record.key for record in results.records()] == ["a"]


def test_a_full_disk_leaves_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = created(tmp_path)
    results.add(a_record(1))

    def full(handle: int, data: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(StorageError, match=r"tiny2.json cannot be written: No space left on device"):
            results.add(a_record(2))
        with pytest.raises(StorageError, match="No space left on device"):
            write_tables(results.folder, [a_record(1)])
    assert [record.seed for record in results.records()] == [1]
    assert [path.name for path in (results.folder / RECORDS).iterdir()] == ["tiny1.json"], "no litter"


def test_a_folder_that_cannot_be_made_has_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError, match="cannot be made"):
        ResultsFolder(tmp_path / "file" / "results").create(REQUESTED)


# Tables


def test_tables_have_a_row_a_run_and_a_row_a_goal(tmp_path: Path) -> None:
    records = [a_record(seed, success=seed != 3) for seed in (1, 2, 3)]
    records.append(a_record(5, figures={"explored": 0.5}, goals=[], success=False, failure="it hung"))
    write_tables(tmp_path, records)
    runs, goals = (pq.read_table(tmp_path / name).to_pylist() for name in (RUNS_TABLE, GOALS_TABLE))
    assert [row["seed"] for row in runs] == [1, 2, 3, 5]
    assert [row["success"] for row in runs] == [True, True, False, False]
    assert [row["time"] for row in runs] == [61.0, 62.0, 63.0, None]
    assert [row["explored"] for row in runs] == [None, None, None, 0.5]
    assert runs[0]["machine_host"] == "kitchen"
    assert runs[3]["failure"] == "it hung"
    assert [(row["scenario"], row["seed"], row["place"], row["reached"]) for row in goals] == [
        ("tiny", 1, "table_1", True),
        ("tiny", 2, "table_1", True),
        ("tiny", 3, "table_1", False),
    ]


def test_tables_of_runs_without_goals_can_be_read(tmp_path: Path) -> None:
    write_tables(tmp_path, [a_record(1, goals=[])])
    assert pq.read_table(tmp_path / GOALS_TABLE).num_rows == 0
    assert pq.read_table(tmp_path / RUNS_TABLE).num_rows == 1


def test_columns_of_any_run_are_in_the_table(tmp_path: Path) -> None:
    write_tables(tmp_path, [a_record(1, machine={}), a_record(3)])
    assert pq.read_table(tmp_path / RUNS_TABLE).to_pylist()[1]["machine_host"] == "kitchen"


def test_a_record_names_its_machine() -> None:
    names = {"host", "architecture", "processor", "python", "chefbot", "numpy", "numba", "mujoco-core"}
    assert names <= machine().keys()
    assert all(isinstance(value, str) and value for value in machine().values())


def test_the_processor_is_the_one_that_numba_compiles_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CPU_NAME", "haswell")
    assert machine()["processor"] == "haswell"
