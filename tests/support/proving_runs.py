"""Runs for the tests of proving: records, small scenarios, and a run that costs nothing and can be held back."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import msgspec

from chefbot.proving.record import GoalRecord, RunRecord
from chefbot.proving.run_spec import RunSpec, run_specs
from chefbot.proving.scenario import Scenario, parse_scenario
from chefbot.proving.worker import RunResult

DRIVE = "name: tiny\nworld: empty\ntask: {type: drive_randomly, duration: 1}\nseeds: 1..4\n"
"""A scenario whose run takes the time of its imports."""
FOLDER = "CHEFBOT_TEST_RUNS"
"""Environment variable: folder in which the runs of `counted_run` are noted."""
HELD = "hold"
"""File in FOLDER that holds back the runs that have begun."""


def tiny(**changes: Any) -> Scenario:
    """Return the scenario of DRIVE with other fields."""
    return msgspec.structs.replace(parse_scenario(DRIVE.encode(), "tiny"), **changes)


def tiny_specs(wanted: list[int], **changes: Any) -> list[RunSpec]:
    """Return the runs of the tiny scenario."""
    return run_specs(tiny(**changes), Path(), wanted)


def a_record(seed: int, *, success: bool = True, scenario: str = "tiny", **fields: Any) -> RunRecord:
    """Return the record of a run that nobody made."""
    given = {
        "key": f"{scenario}{seed}",
        "failure": "" if success else "the robot did not return home",
        "figures": {"time": 60.0 + seed % 7, "collisions": 0.0},
        "goals": [GoalRecord(place="table_1", began=1.0, ended=20.0, reached=success, distance=0.1)],
        "path": [(0.0, 0.0, 0.0), (0.5, 0.1, 0.2), (1.0, 0.3, 0.2)],
        "incidents": [(0.5, 0.1, 0.2, "near miss")],
        "messages": f"{seed:032x}",
        "sim_time": 60.0,
        "machine": {"host": "kitchen", "processor": "x"},
    }
    return RunRecord(scenario=scenario, seed=seed, success=success, **{**given, **fields})


def held_seeds(folder: Path) -> list[str]:
    """Return the seeds of the runs that are held back, by the file HELD; those left by another test continue."""
    try:
        return (folder / HELD).read_text().split()
    except FileNotFoundError:
        return []


def counted_run(packed: bytes) -> RunResult:
    """Note that a run has begun, wait while runs are held back, note that it has ended, and return a record."""
    spec = msgspec.msgpack.decode(packed, type=RunSpec)
    folder = Path(os.environ[FOLDER])
    with (folder / f"begun_{spec.seed}").open("a") as file:
        file.write(f"{os.getpid()}\n")
    while str(spec.seed) in held_seeds(folder):
        time.sleep(0.02)
    with (folder / f"ended_{spec.seed}").open("a") as file:
        file.write(f"{os.getpid()}\n")
    return RunResult(msgspec.json.encode(a_record(spec.seed, key=spec.key)))
