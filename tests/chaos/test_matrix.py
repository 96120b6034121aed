"""The reliability matrix: its rows, its units, its page, and a part of it that changes with the commit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chefbot.proving.scenario import Scenario
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from tests.chaos.launch_process import report
from tests.chaos.matrix.__main__ import current_commit, safe_runs
from tests.chaos.matrix.measure import UnitResult, make_run, run_tests
from tests.chaos.matrix.page import page, verdict
from tests.chaos.matrix.rows import ROOT, SuiteCheck, load_rows
from tests.chaos.matrix.units import Unit, rotated, units_of

ROWS = load_rows()
UNITS = [unit for row in ROWS for unit in units_of(row)]
RUNS = [unit for unit in UNITS if isinstance(unit.work, Scenario)]


def a_result(unit: Unit, **fields: object) -> UnitResult:
    given = {
        "safe": True,
        "done": True,
        "sentence": "task done",
        "tries": 1,
        "commit": "abc",
        "date": "2026-01-01",
    }
    return UnitResult(row=unit.row, unit=unit.name, seed=unit.seed, **{**given, **fields})  # type: ignore[arg-type]


def test_every_fault_from_r1_to_r38_has_a_row() -> None:
    assert [row.id for row in ROWS] == [f"R{i}" for i in range(1, 39)]
    for row in ROWS:
        assert row.checks or row.unmeasured, f"{row.id} is neither measured nor states why not"


def test_the_tests_of_the_matrix_exist() -> None:
    paths = [path for unit in UNITS if isinstance(unit.work, SuiteCheck) for path in unit.work.paths]
    assert [path for path in paths if not (ROOT / path).exists()] == []


def test_units_have_names_of_their_own_and_odd_seeds() -> None:
    names = [(unit.row, unit.name) for unit in UNITS]
    assert len(names) == len(set(names))
    assert all(unit.seed % 2 == 1 for unit in RUNS)
    assert [unit.seed for unit in RUNS] == [
        unit.seed for row in ROWS for unit in units_of(row) if isinstance(unit.work, Scenario)
    ]


def test_no_run_has_a_fault_of_a_sensor_that_the_robot_lacks() -> None:
    robots = {str(unit.work.robot) for unit in RUNS}  # type: ignore[union-attr]
    names = {name for name in robots if load_robot(name).sensors.lidar is None}
    without_lidar = [unit for unit in RUNS if str(unit.work.robot) in names]  # type: ignore[union-attr]
    assert without_lidar
    assert not [unit.name for unit in without_lidar if "lidar" in unit.name.partition(":")[2]]


def test_runs_name_nodes_of_the_launch() -> None:
    nodes = set(load_launch("waiter", {"map_file": "map.yaml", "robot": "chefbot"}).nodes)
    named = {fault.node for unit in RUNS for fault in unit.work.faults if hasattr(fault, "node")}  # type: ignore[union-attr]
    assert named <= nodes


def test_each_commit_has_another_order() -> None:
    first, second = rotated(UNITS, "1111111"), rotated(UNITS, "2222222")
    assert first != second and set(map(str, first)) == set(map(str, second))
    assert first == rotated(UNITS, "1111111")


@pytest.mark.slow
def test_a_failing_test_is_not_safe(tmp_path: Path) -> None:
    (tmp_path / "test_one.py").write_text("def test_a(): print('stopped after 5 ms')\n")
    assert run_tests(SuiteCheck(paths=[str(tmp_path / "test_one.py")])) == (
        True,
        True,
        "stopped after 5 ms",
        1,
    )
    (tmp_path / "test_two.py").write_text("def test_a(): pass\ndef test_b(): assert False\n")
    assert run_tests(SuiteCheck(paths=[str(tmp_path / "test_two.py")])) == (
        False,
        False,
        "1 of 2 tests failed: test_b: assert False",
        2,
    )
    (tmp_path / "test_quiet.py").write_text("def test_a(): pass\n")
    assert run_tests(SuiteCheck(paths=[str(tmp_path / "test_quiet.py")]))[2] == "1 test passes"
    (tmp_path / "test_three.py").write_text("import pytest\ndef test_a(): pytest.skip('not here')\n")
    assert not run_tests(SuiteCheck(paths=[str(tmp_path / "test_three.py")]))[0]


def test_the_page_lists_failures_first() -> None:
    units = [unit for unit in UNITS if unit.row == "R10"]
    results = [a_result(units[2]), a_result(units[3], safe=False, sentence="contact at 0.35 m/s")]
    text = page(ROWS, {row.id: 5 for row in ROWS}, results, "abc", "2026-01-01")
    fails, table = text.split("## All faults")
    assert f"- R10, {units[3].name}: contact at 0.35 m/s" in fails
    assert re.search(r"\| R10 \|.*1 of 2 runs safe.*\*\*fails\*\* \|", table)
    assert all(f"| {row.id} |" in table for row in ROWS)


def test_what_was_measured_is_one_list_in_a_cell() -> None:
    unit = next(unit for unit in UNITS if unit.row == "R4" and not unit.seed)
    results = [a_result(unit, sentence="8 tests pass"), a_result(unit, sentence="1 test passes")]
    text = page(ROWS, {row.id: 2 for row in ROWS}, results, "abc", "2026-01-01")
    assert "| 8 tests pass; 1 test passes; the Tiva runs in no emulator |" in text


def test_results_of_another_commit_do_not_count() -> None:
    unit = RUNS[0]
    old = a_result(unit, commit="older", safe=False, sentence="contact")
    assert "Nothing that was run." in page(ROWS, {row.id: 1 for row in ROWS}, [old], "abc", "2026-01-01")


@pytest.mark.parametrize(
    ("count", "run", "word"),
    [(0, 0, "not measured"), (3, 0, "not run"), (3, 3, "passes"), (3, 1, "passes so far")],
)
def test_a_row_that_was_run_in_part_is_marked(count: int, run: int, word: str) -> None:
    assert verdict(count, [a_result(RUNS[0])] * run) == word


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_a_part_of_the_runs_is_still_safe() -> None:
    """One run, another for each commit, of those that were safe when the matrix was last written."""
    safe = safe_runs()
    part = [unit for unit in rotated(RUNS, current_commit()) if f"{unit.row} {unit.name}" in safe][:1]
    for unit in part:
        report(f"{unit.row} {unit.name}, seed {unit.seed}")
        assert isinstance(unit.work, Scenario)
        is_safe, _, sentence, _ = make_run(unit.work, unit.seed)
        assert is_safe, f"{unit.row} {unit.name}, seed {unit.seed}: {sentence}"
    assert part or not safe
