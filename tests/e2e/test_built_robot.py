"""The final run of the book's chapter on the bytes of emulated hardware: the robot knows two serial ports alone."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec
import pytest

from chefbot.proving.run import make_run
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import load_scenario
from chefbot.proving.scenario_tasks import BuiltTask

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")


@pytest.mark.long
def test_a_built_robot_maps_saves_localizes_and_drives_to_a_goal(tmp_path: Path) -> None:
    scenario = msgspec.structs.replace(load_scenario("built"), task=BuiltTask(goals=1))
    (spec,) = run_specs(scenario, Path(), [1])
    record = make_run(spec, tmp_path)
    logs = "".join(path.read_text() for path in sorted(tmp_path.glob("*.log")))
    assert record.success, f"{record.failure}\n{logs}"
    assert (tmp_path / "map.yaml").exists()
    assert record.figures["collisions"] == 0.0 and record.goals[0].reached
