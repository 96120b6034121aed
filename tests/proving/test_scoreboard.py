"""The scoreboard: its order, figures and texts, and which runs are made for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.support.proving_runs import a_record, tiny

from chefbot.proving import scoreboard
from chefbot.proving.record import RunRecord
from chefbot.proving.scenario import Scenario
from chefbot.proving.scenario_tasks import BuiltTask, RunLimits
from chefbot.proving.scoreboard import SEEDS, run_scoreboard, scoreboard_text
from chefbot.proving.statistics import wilson


def one(name: str, **changes: Any) -> Scenario:
    return tiny(name=name, description=f"what {name} shows", **changes)


def runs(name: str, successes: int, failures: int, **fields: Any) -> list[RunRecord]:
    return [
        a_record(seed, success=seed < successes, scenario=name, **fields)
        for seed in range(successes + failures)
    ]


def rows(text: str) -> dict[str, list[str]]:
    """Return the cells of each scenario's row, in the order of the page."""
    lines = [line.split(" | ") for line in text.splitlines() if line.startswith("| `")]
    return {cells[0].strip("| `"): [cell.strip(" |") for cell in cells[1:]] for cells in lines}


def test_the_lowest_success_comes_first_and_runs_not_made_last() -> None:
    scenarios = [one("good"), one("never"), one("bad"), one("fair")]
    records = runs("good", 4, 0) + runs("bad", 0, 4) + runs("fair", 2, 2)
    table = rows(scoreboard_text(scenarios, records))
    assert list(table) == ["bad", "fair", "good", "never"]
    assert table["never"][1:3] == ["0", "not run"]
    assert [table[name][2] for name in ("bad", "fair", "good")] == ["0%", "50%", "100%"]


def test_a_row_has_wilsons_interval_and_the_mean_of_collisions() -> None:
    records = runs("one", 3, 1, figures={"collisions": 2.0}) + runs("one", 1, 0, figures={})
    cells = rows(scoreboard_text([one("one")], records))["one"]
    share = wilson(4, 5)
    assert cells[1] == "5" and cells[3] == f"{share.low:.0%} to {share.high:.0%}"
    assert cells[5] == "1.60"


@pytest.mark.parametrize(
    ("times", "median"), [([9.0], "9"), ([1.0, 100.0], "50"), ([1.0, 30.0, 100.0], "30")]
)
def test_the_median_of_an_even_number_is_between_the_middle_ones(times: list[float], median: str) -> None:
    records = [a_record(seed, sim_time=time, scenario="one") for seed, time in enumerate(times)]
    assert rows(scoreboard_text([one("one")], records))["one"][4] == median


def test_the_usual_failure_is_named_with_an_example() -> None:
    failures = ["not reached: table_1", "3 collisions", "not reached: table|2; more", "Trace\nboom: 1"]
    records = [a_record(k, success=False, failure=text, scenario="one") for k, text in enumerate(failures)]
    text = scoreboard_text([one("one")], records)
    assert rows(text)["one"][6] == "2 x not reached: table_1"
    (cell,) = [rows(scoreboard_text([one("one")], [records[2]]))["one"][6]]
    assert cell == "1 x not reached: table/2; more", "no text adds a column"
    assert rows(scoreboard_text([one("one")], runs("one", 2, 0)))["one"][6] == ""


def test_the_page_explains_what_each_scenario_shows() -> None:
    text = scoreboard_text([one("one", peer="0.9 by others"), one("two")], [])
    assert "- `one`: what one shows Published elsewhere: 0.9 by others\n" in text
    assert "- `two`: what two shows\n" in text
    assert "processors none" in text


def test_the_processors_of_all_machines_are_named_once() -> None:
    records = [a_record(k, machine={"processor": name}) for k, name in enumerate(["zen", "skylake", "zen"])]
    assert "processors skylake, zen." in scoreboard_text(
        [tiny()], [*records, a_record(9, machine={})]
    ).replace("?, ", "")


@pytest.fixture
def specs(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Make no run but for the first three that are missing; return what was requested."""
    requested: list[Any] = []

    def make_missing(results: Any, missing: Any, done: dict[str, RunRecord], *_: Any) -> None:
        requested.extend(missing)
        for spec in missing[:3]:
            done[spec.key] = a_record(spec.seed, scenario=spec.scenario.name, key=spec.key)

    monkeypatch.setattr(scoreboard, "make_missing", make_missing)
    monkeypatch.setattr(scoreboard, "built_in_scenarios", lambda: {"drive": Path(), "go": Path()})
    monkeypatch.setattr(scoreboard, "load_scenario", lambda name: tiny(name=name))
    return requested


def test_all_scenarios_with_the_first_odd_seed_come_first(tmp_path: Path, specs: list[Any]) -> None:
    assert run_scoreboard(tmp_path / "page.md", tmp_path / "out", 1.0, 1, "") == 0
    assert [(spec.scenario.name, spec.seed) for spec in specs[:4]] == [
        ("drive", 1), ("go", 1), ("drive", 3), ("go", 3),
    ]  # fmt: skip
    assert len(specs) == 2 * len(SEEDS) and all(spec.seed % 2 for spec in specs)
    table = rows((tmp_path / "page.md").read_text())
    assert {name: cells[1] for name, cells in table.items()} == {"drive": "2", "go": "1"}
    assert list((tmp_path / "out").glob("*.csv")) or list((tmp_path / "out").glob("*.parquet"))


def test_long_runs_come_late_and_those_in_real_time_last(
    tmp_path: Path, specs: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = tiny()
    kinds = {
        "built": {"task": BuiltTask()},
        "explore": {"limits": RunLimits(time=3600.0)},
        "go": {"limits": RunLimits(time=3599.0)},
    }
    monkeypatch.setattr(scoreboard, "built_in_scenarios", lambda: kinds)
    monkeypatch.setattr(
        scoreboard,
        "load_scenario",
        lambda name: tiny(**{"name": name, "task": usual.task, "limits": usual.limits, **kinds[name]}),
    )
    run_scoreboard(tmp_path / "page.md", tmp_path / "out", 1.0, 1, "")
    names = [spec.scenario.name for spec in specs]
    assert names == [name for name in ("go", "explore", "built") for _ in SEEDS]
    assert [spec.seed for spec in specs] == 3 * SEEDS
