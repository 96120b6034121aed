"""One run of each task, in small worlds, as a scenario's run makes it."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from chefbot.proving.record import RunRecord
from chefbot.proving.run import make_run
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import load_scenario, parse_scenario

REGRESSIONS = sorted((Path(__file__).parents[1] / "regressions").glob("*.yaml"))
SCENARIOS = {
    "explore": "world: room, task: {type: explore}, criteria: {explored: {min: 0.95}, map_error_max: {max: 0.1}}",
    "localize": "world: {kind: home}, task: {type: localize}, criteria: {localization_error_max: {max: 0.1}}",
    "go": "world: {kind: home}, task: {type: go, goals: 2}, criteria: {goals_reached: {min: 1}}",
    "deliver": "world: room, people: 2, task: {type: deliver, tables: 1}",
    "deliver on its own map": "world: room, task: {type: deliver, tables: 1, map: explored}, "
    "criteria: {collisions: {max: 0}, explored: {min: 0.95}, map_error_max: {max: 0.1}}",
    "drive": "world: workshop, task: {type: drive_randomly, duration: 20}, criteria: {map_error_max: {max: 0.1}}",
    "drawn robot": "world: room, robot: {numbers: {}}, task: {type: drive_randomly, duration: 5}",
}
ROOM = 4.0
"""Half the side of the square room of the recorded log, m."""


def run(text: str, folder: Path, seed: int = 1) -> RunRecord:
    scenario = parse_scenario(f"{{name: test, {text}}}".encode(), "test")
    (folder / "run").mkdir()
    return make_run(run_specs(scenario, folder, [seed])[0], folder / "run")


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.parametrize("task", SCENARIOS)
def test_a_run_of_each_task_succeeds(tmp_path: Path, task: str) -> None:
    record = run(SCENARIOS[task], tmp_path)
    assert record.success, record.failure
    assert record.figures["collisions"] == 0.0
    assert len(record.path) > 2 and record.messages and record.plan.startswith(b"\x89PNG")


@pytest.mark.rotated("equal runs")
@pytest.mark.slow
def test_equal_seeds_give_equal_records(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    first, second = (run(SCENARIOS["localize"], folder, 3) for folder in (tmp_path, tmp_path / "b"))
    assert (first.messages, first.figures, first.path) == (second.messages, second.figures, second.path)


def carmen_log(steps: int) -> tuple[str, str]:
    """Return the log of a laser that drives along x in a square room, and the relations of its true poses."""
    lines, relations = [], []
    angles = [math.radians(i - 90.0) for i in range(181)]
    for k in range(steps):
        x = 0.05 * k - 1.5
        ranges = [min(_distance(x, 0.0, angle), 20.0) for angle in angles]
        pose = f"{x:.4f} 0 0"
        beams = " ".join(f"{r:.3f}" for r in ranges)
        lines.append(f"FLASER 181 {beams} {pose} {pose} {k * 0.5:.2f} host {k * 0.5:.2f}")
        if k:
            relations.append(f"{(k - 1) * 0.5:.2f} {k * 0.5:.2f} 0.05 0 0 0 0 0")
    return "\n".join(lines) + "\n", "\n".join(relations) + "\n"


def _distance(x: float, y: float, angle: float) -> float:
    """Return the distance to the walls of the room from a point inside of it."""
    c, s = math.cos(angle), math.sin(angle)
    across = (math.copysign(ROOM, c) - x) / c if abs(c) > 1e-9 else math.inf
    along = (math.copysign(ROOM, s) - y) / s if abs(s) > 1e-9 else math.inf
    return min(across, along)


@pytest.mark.slow
def test_a_log_is_mapped_and_compared_with_relations(tmp_path: Path) -> None:
    log, relations = carmen_log(60)
    (tmp_path / "room.log").write_text(log)
    (tmp_path / "room.relations").write_text(relations)
    task = "task: {type: map_log, log: room.log, relations: room.relations, particles: 5}"
    record = run(f"{task}, criteria: {{relation_error: {{max: 0.02}}}}", tmp_path)
    assert record.success, record.failure
    assert 0.0 < record.figures["relation_error"] < 0.02


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.parametrize("path", REGRESSIONS, ids=lambda path: path.stem)
def test_a_known_failure_stays_known(tmp_path: Path, path: Path) -> None:
    """A fixed one succeeds: empty its `known_failure`, and it must not fail again."""
    scenario = load_scenario(str(path))
    (tmp_path / "run").mkdir()
    spec = run_specs(scenario, path.parent, [int(scenario.seeds)])[0]
    record = make_run(spec, tmp_path / "run")
    assert record.success == (not scenario.known_failure), record.failure
