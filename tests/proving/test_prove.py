"""`chefbot prove`: what is made and what is kept, exit codes, claims, comparison, and bad input."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pyarrow.parquet as pq
import pytest
import typer
from tests.support.proving_runs import DRIVE, a_record

from chefbot.cli.completion import scenarios
from chefbot.cli.run.prove import prove as prove_command
from chefbot.errors import ChefbotError, UserError
from chefbot.proving import page, prove
from chefbot.proving.prove import PAGE, ProveOptions, list_scenarios, run_prove
from chefbot.proving.record import RunRecord
from chefbot.proving.results_folder import GOALS_TABLE, RUNS_TABLE, ResultsFolder
from chefbot.proving.run_spec import RunSpec, run_specs
from chefbot.proving.scenario import built_in_scenarios, load_scenario
from chefbot.storage.atomic_files import StorageError


class Runs:
    """Makes the runs instead of a cluster; `made`: seeds in spec."""

    def __init__(self) -> None:
        self.made: list[int] = []
        self.fail: set[int] = set()
        self.reason = ""
        self.figures: dict[str, float] = {"time": 60.0}
        self.error: BaseException | None = None
        self.after = 10**9
        """Runs after which `error` is raised."""

    def collect(self, _: Any, specs: list[RunSpec], add: Any) -> None:
        for spec in specs:
            if self.error is not None and len(self.made) >= self.after:
                raise self.error
            self.made.append(spec.seed)
            ok = spec.seed not in self.fail
            record = a_record(spec.seed, success=ok, key=spec.key, scenario=spec.scenario.name)
            if not ok and self.reason:
                record = msgspec.structs.replace(record, failure=self.reason)
            add(with_figures(record, self.figures), b"log" if spec.record else b"")


def with_figures(record: RunRecord, figures: dict[str, float]) -> RunRecord:
    return msgspec.structs.replace(record, figures=figures)


@contextmanager
def no_cluster(address: str, workers: int) -> Iterator[SimpleNamespace]:
    yield SimpleNamespace(address=address)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Runs:
    one = Runs()
    monkeypatch.setattr(prove, "collect", one.collect)
    monkeypatch.setattr(prove, "cluster", no_cluster)
    monkeypatch.setattr(prove, "compile_kernels", lambda *_: None)
    monkeypatch.setattr(page, "path_picture", lambda *_: None)  # the pictures have their own tests
    monkeypatch.setattr(page, "distributions", lambda *_: None)
    return one


@pytest.fixture
def scenario(tmp_path: Path) -> str:
    path = tmp_path / "tiny.yaml"
    path.write_text(DRIVE)
    return str(path)


def options(out: Path, *names: str, **given: Any) -> ProveOptions:
    defaults: dict[str, Any] = {
        "seeds": "1..4",
        "robot": "",
        "workers": 1,
        "scheduler": "",
        "resume": False,
        "record": False,
        "against": None,
    }
    return ProveOptions(names=names, out=out, **{**defaults, **given})


def test_a_proof_leaves_records_tables_and_a_page(tmp_path: Path, scenario: str, runs: Runs) -> None:
    out = tmp_path / "out"
    assert run_prove(options(out, scenario)) == 0
    assert runs.made == [1, 2, 3, 4]
    assert [record.seed for record in ResultsFolder(out).records()] == [1, 2, 3, 4]
    assert pq.read_table(out / RUNS_TABLE).num_rows == pq.read_table(out / GOALS_TABLE).num_rows == 4
    assert (out / PAGE).read_text().startswith("<!doctype html>")


def test_seeds_are_the_scenarios_own_unless_given(tmp_path: Path, scenario: str, runs: Runs) -> None:
    run_prove(options(tmp_path / "a", scenario, seeds=None))
    run_prove(options(tmp_path / "b", scenario, seeds="7"))
    assert runs.made == [1, 2, 3, 4, 7]


def test_a_run_that_is_done_is_not_made_again(tmp_path: Path, scenario: str, runs: Runs) -> None:
    run_prove(options(tmp_path / "out", scenario, seeds="1..2"))
    run_prove(options(tmp_path / "out", scenario, seeds="1..3"))
    run_prove(options(tmp_path / "out", scenario, seeds="1..3"))
    assert runs.made == [1, 2, 3]
    assert pq.read_table(tmp_path / "out" / RUNS_TABLE).num_rows == 3


def test_a_damaged_record_is_made_again(tmp_path: Path, scenario: str, runs: Runs) -> None:
    run_prove(options(tmp_path / "out", scenario, seeds="1..2"))
    record = ResultsFolder(tmp_path / "out").records()[1]
    (tmp_path / "out" / "records" / f"{record.key}.json").write_bytes(b"{")
    run_prove(options(tmp_path / "out", scenario, seeds="1..2"))
    assert runs.made == [1, 2, record.seed]


def test_a_run_is_made_again_for_its_log(tmp_path: Path, scenario: str, runs: Runs) -> None:
    run_prove(options(tmp_path / "out", scenario, seeds="1"))
    run_prove(options(tmp_path / "out", scenario, seeds="1", record=True))
    run_prove(options(tmp_path / "out", scenario, seeds="1", record=True))
    assert runs.made == [1, 1]
    assert (tmp_path / "out" / "logs" / "tiny_1.mcap").read_bytes() == b"log"


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), UserError("the scheduler went away"), StorageError("full")]
)
def test_what_is_done_stays_done_and_resume_goes_on(
    tmp_path: Path, scenario: str, runs: Runs, error: BaseException, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    runs.error, runs.after = error, 2
    with pytest.raises(type(error)):
        run_prove(options(out, scenario, seeds="1..5"))
    assert [record.seed for record in ResultsFolder(out).records()] == [1, 2]
    assert pq.read_table(out / RUNS_TABLE).num_rows == 2, "the page shows what is there"
    if isinstance(error, KeyboardInterrupt):
        assert (
            f"2 of 5 runs are done and kept; `chefbot prove --resume --out {out}`" in capsys.readouterr().out
        )
    runs.error = None
    assert run_prove(options(out, seeds="", resume=True)) == 0
    assert runs.made == [1, 2, 3, 4, 5]


def test_nothing_done_before_an_error_leaves_the_error(tmp_path: Path, scenario: str, runs: Runs) -> None:
    runs.error, runs.after = UserError("no such number"), 0
    with pytest.raises(UserError, match="no such number"):
        run_prove(options(tmp_path / "out", scenario))
    assert not (tmp_path / "out" / PAGE).exists()


def test_a_full_disk_in_the_middle_is_reported_in_one_sentence(
    tmp_path: Path, scenario: str, runs: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, write = tmp_path / "out", os.write

    def until_full(handle: int, data: bytes) -> int:
        if len(runs.made) > 2:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(handle, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", until_full)
        with pytest.raises(StorageError, match="cannot be written: No space left on device") as caught:
            run_prove(options(out, scenario))
    assert "\n" not in str(caught.value)
    assert [record.seed for record in ResultsFolder(out).records()] == [1, 2]
    run_prove(options(out, seeds="", resume=True))
    assert runs.made == [1, 2, 3, 3, 4]


# Verdicts


def test_a_missed_claim_gives_exit_code_1(
    tmp_path: Path, scenario: str, runs: Runs, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(scenario).write_text(DRIVE + "claim: 0.6\n")
    runs.fail = {3}
    assert run_prove(options(tmp_path / "out", scenario)) == 1
    assert "claim missed: tiny claims 60% success, 1 of 2 judged runs succeeded" in capsys.readouterr().out
    Path(scenario).write_text(DRIVE + "claim: 0.5\n")
    assert run_prove(options(tmp_path / "out", scenario)) == 0
    assert runs.made == [1, 2, 3, 4], "a claim changes no run"


def test_even_seeds_neither_keep_nor_miss_a_claim(
    tmp_path: Path, scenario: str, runs: Runs, capsys: pytest.CaptureFixture[str]
) -> None:
    Path(scenario).write_text(DRIVE + "claim: 1.0\n")
    runs.fail = {2, 4}
    assert run_prove(options(tmp_path / "out", scenario)) == 0
    assert run_prove(options(tmp_path / "even", scenario, seeds="2,4")) == 0
    assert "tiny claims 100% success: not judged without odd seeds" in capsys.readouterr().out


def test_a_run_that_could_not_begin_gives_exit_code_1(
    tmp_path: Path, scenario: str, runs: Runs, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also with even seeds: it is not a failure of the robot."""
    runs.fail, runs.reason = {4}, "it cannot run: no node is called [plannner]"
    assert run_prove(options(tmp_path / "out", scenario, seeds="2,4")) == 1
    assert "1 of 2 runs could not begin: no node is called [plannner]" in capsys.readouterr().out


def test_the_summary_keeps_odd_and_even_seeds_apart(
    tmp_path: Path, scenario: str, runs: Runs, capsys: pytest.CaptureFixture[str]
) -> None:
    runs.fail = {2}
    run_prove(options(tmp_path / "out", scenario))
    output = " ".join(capsys.readouterr().out.split())
    assert "tiny odd, judged 2 of 2" in output
    assert "tiny even, not judged 1 of 2" in output


def proof(folder: Path, scenario: str, runs: Runs, fail: set[int], time: float) -> Path:
    runs.fail, runs.figures = fail, {"time": time}
    run_prove(options(folder, scenario, seeds="1..41"))
    return folder


@pytest.mark.parametrize(
    ("fail", "time", "code", "sentence"),
    [
        (set(), 60.0, 0, ""),
        (set(range(1, 20, 2)), 60.0, 1, "worse: tiny, success: 1 -> 0.5"),
        (set(range(2, 20, 2)), 60.0, 0, ""),
        (set(), 50.0, 0, "better: tiny, time: 60 -> 50"),
        (set(), 70.0, 1, "worse: tiny, time: 60 -> 70"),
    ],
)
def test_only_what_got_worse_gives_exit_code_1(
    tmp_path: Path,
    scenario: str,
    runs: Runs,
    fail: set[int],
    time: float,
    code: int,
    sentence: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    old, new = (
        proof(tmp_path / "old", scenario, runs, set(), 60.0),
        proof(tmp_path / "new", scenario, runs, fail, time),
    )
    capsys.readouterr()
    assert run_prove(options(new, scenario, seeds="1..41", against=old)) == code
    output = capsys.readouterr().out
    assert sentence in output
    assert ("\nworse: " in output) == bool(code)
    assert "Against the older results" in (new / PAGE).read_text()


# Bad input


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"seeds": "1-4"}, "--seeds '1-4'"),
        ({"robot": "chefbt"}, "chefbt"),
        ({"robot": "absent.yaml"}, "absent.yaml does not exist"),
        ({"against": Path("absent")}, "absent holds no results of runs"),
    ],
)
def test_bad_options_have_one_sentence_and_run_nothing(
    tmp_path: Path, scenario: str, runs: Runs, given: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ChefbotError, match=sentence) as caught:
        run_prove(options(tmp_path / "out", scenario, **given))
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()
    assert runs.made == []


def test_two_scenarios_of_one_name_are_refused(tmp_path: Path, scenario: str, runs: Runs) -> None:
    with pytest.raises(UserError, match="two scenarios are called tiny"):
        run_prove(options(tmp_path / "out", scenario, scenario))


def test_resume_needs_a_proof(tmp_path: Path, runs: Runs) -> None:
    with pytest.raises(UserError, match="holds no results to resume"):
        run_prove(options(tmp_path, resume=True))


def test_a_robot_file_is_named_from_the_current_folder(
    tmp_path: Path, runs: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (tmp_path / "here" / "own.yaml").write_text("like: chefbot_lidar\nname: own\n")
    (tmp_path / "there" / "tiny.yaml").write_text(DRIVE)
    monkeypatch.chdir(tmp_path / "here")
    run_prove(options(tmp_path / "out", "../there/tiny.yaml", robot="own.yaml", seeds="1"))
    monkeypatch.chdir(tmp_path)
    run_prove(options(tmp_path / "out", resume=True))
    assert runs.made == [1]


def test_files_lie_beside_a_scenario_file_of_any_name(
    tmp_path: Path, runs: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "plan.yaml").write_text("name: plan\nplaces:\n  home: {x: 0 m, y: 0 m}\n")
    (tmp_path / "there" / "tiny").write_text(DRIVE.replace("world: empty", "world: plan.yaml"))
    monkeypatch.chdir(tmp_path)
    assert run_prove(options(tmp_path / "out", "there/tiny", seeds="1")) == 0


# Command line


def test_without_a_name_the_scenarios_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    prove_command(names=None, resume=False)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(built_in_scenarios())
    list_scenarios()
    assert capsys.readouterr().out.splitlines() == lines


def test_names_and_resume_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--resume takes the scenarios, seeds and robot from --out"):
        prove_command(names=["crowd"], resume=True, out=tmp_path)


def test_the_command_ends_with_the_exit_code(tmp_path: Path, scenario: str, runs: Runs) -> None:
    Path(scenario).write_text(DRIVE + "claim: 1.0\n")
    runs.fail = {1}
    with pytest.raises(typer.Exit) as end:
        prove_command(
            names=[scenario],
            seeds="1",
            robot="",
            workers=0,
            scheduler="",
            out=tmp_path / "out",
            resume=False,
            record=False,
            against=None,
        )
    assert end.value.exit_code == 1


def test_scenarios_are_completed() -> None:
    assert scenarios("deliver_") == [
        "deliver_any_hotel",
        "deliver_any_robot",
        "deliver_hotel",
        "deliver_hotel_camera",
    ]


def test_a_wrong_scheduler_is_refused_before_compiling(
    scenario: str, tmp_path: Path, runs: Runs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prove, "compile_kernels", lambda *_: pytest.fail("compiled first"))
    with pytest.raises(UserError, match="tcp://HOST:PORT"):
        prove.make_missing(
            ResultsFolder(tmp_path / "out"), run_specs(load_scenario(scenario), tmp_path, [1]), {}, 1, "foo"
        )
    assert runs.made == []
