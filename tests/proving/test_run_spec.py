"""The key of a run changes with all that its result depends on, and with nothing else."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.proving_runs import tiny, tiny_specs

from chefbot.errors import UserError
from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.proving import run_spec
from chefbot.proving.run_spec import (
    RunSpec,
    code_hash,
    run_specs,
    with_absolute_paths,
    with_relative_paths,
)
from chefbot.proving.scenario import Building
from chefbot.proving.scenario_tasks import Bounds, DriveRandomlyTask, MapLogTask, RunLimits
from chefbot.proving.worker import check_code
from chefbot.sim.faults.events import SensorFreeze
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places

KEY = tiny_specs([1])[0].key


def test_equal_runs_have_equal_keys_whoever_makes_them(tmp_path: Path) -> None:
    assert run_specs(tiny(), tmp_path, [1], record=True)[0].key == KEY
    assert [spec.key for spec in tiny_specs([3, 1])][1] == KEY


@pytest.mark.parametrize("change", [{"description": "x."}, {"claim": 0.9}, {"seeds": "1..7"}])
def test_what_no_result_depends_on_is_not_in_the_key(change: dict[str, object]) -> None:
    assert tiny_specs([1], **change)[0].key == KEY


def test_all_that_a_result_depends_on_is_in_the_key() -> None:
    changes: list[dict[str, object]] = [
        {"name": "other"},
        {"world": "room"},
        {"world": Building(kind="home")},
        {"world": Building(kind="home", numbers={"glass": 0.0})},
        {"robot": "chefbot"},
        {"profile": "perfect"},
        {"start": [0.0, 0.0, 1.0]},
        {"people": 2},
        {"task": DriveRandomlyTask(duration=2.0)},
        {"limits": RunLimits(time=60.0)},
        {"criteria": {"collisions": Bounds(max=1)}},
    ]
    keys = {tiny_specs([1], **change)[0].key for change in changes}
    assert len(keys | {KEY}) == len(changes) + 1


def test_files_move_with_the_scenario_that_names_them(tmp_path: Path) -> None:
    log = MapLogTask(log="logs/one.log", relations="logs/one.relations")
    scenario = tiny(world="maps/a.yaml", robot="mine.yaml", task=log)
    absolute = with_absolute_paths(scenario, tmp_path)
    assert absolute.world == str(tmp_path / "maps/a.yaml") and absolute.robot == str(tmp_path / "mine.yaml")
    below = with_relative_paths(absolute, tmp_path / "regressions")
    assert (below.world, below.robot) == ("../maps/a.yaml", "../mine.yaml")
    assert below.task == MapLogTask(log="../logs/one.log", relations="../logs/one.relations")
    assert with_absolute_paths(below, tmp_path / "regressions").world != below.world
    assert with_relative_paths(with_absolute_paths(tiny(), tmp_path), tmp_path) == tiny(), "names stay names"


def test_a_fault_of_a_sensor_that_the_robot_lacks_is_refused() -> None:
    fault = SensorFreeze(sensor="lidar", at=3.0)
    assert tiny_specs([1], robot="chefbot_lidar", faults=(fault,))
    with pytest.raises(UserError, match="lidar is impossible: robot chefbot has no lidar"):
        tiny_specs([1], robot="chefbot", faults=(fault,))


def test_every_field_of_a_scenario_was_thought_of() -> None:
    fields = {field.name for field in msgspec.structs.fields(tiny())}
    ignored = {"description", "claim", "seeds"}
    counted = {"name", "world", "robot", "profile", "start", "people", "task", "limits", "criteria"}
    assert counted | ignored <= fields


def test_each_seed_has_its_own_key() -> None:
    assert len({spec.key for spec in tiny_specs(list(range(200)))}) == 200


def test_the_key_depends_on_the_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_spec, "code_hash", lambda: "other")
    spec = tiny_specs([1])[0]
    assert (spec.key != KEY, spec.code) == (True, "other")


def test_the_code_is_all_source_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "chefbot"
    (package / "worlds").mkdir(parents=True)
    (package / "__init__.py").write_text("")
    hashes = set()
    for name, text in (("a.py", "1"), ("a.py", "2"), ("worlds/a.yaml", "1"), ("worlds/b.yaml", "1")):
        (package / name).write_text(text)
        monkeypatch.setattr(run_spec.chefbot, "__file__", str(package / "__init__.py"))
        hashes.add(code_hash.__wrapped__())
    (package / "a.pyc").write_text("compiled")
    assert len(hashes) == 4
    assert code_hash.__wrapped__() in hashes


def test_other_code_is_refused_with_both_hashes() -> None:
    check_code(code_hash())
    with pytest.raises(UserError, match=rf"worker on .+ another version .*{code_hash()}, not 0123"):
        check_code("0123")


def own_map(folder: Path, cells: int = 40) -> Path:
    grid = Grid(room_of(cells), 0.1, -2.0, -2.0)
    save_map(folder / "plan", grid)
    return folder / "plan.yaml"


def room_of(size: int) -> NDArray[np.int8]:
    cells = np.full((size, size), FREE, np.int8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = OCCUPIED
    return cells


def spec_of_map(folder: Path) -> RunSpec:
    return run_specs(tiny(world="plan.yaml"), folder, [1])[0]


def test_the_files_of_a_map_travel_with_the_run(tmp_path: Path) -> None:
    own_map(tmp_path)
    spec = spec_of_map(tmp_path)
    assert set(spec.files) == {"world.yaml", "plan.pgm"}
    assert spec.scenario.world == "world.yaml"
    save_places(places_path(tmp_path / "plan.yaml"), {"home": SE2(0.5, 0.5, 0.0)})
    placed = spec_of_map(tmp_path)
    assert set(placed.files) == {"world.yaml", "plan.pgm", "world.places.yaml"}
    own_map(tmp_path, 41)
    assert len({spec.key, placed.key, spec_of_map(tmp_path).key}) == 3


def test_the_folder_of_the_files_is_not_in_the_key(tmp_path: Path) -> None:
    keys = set()
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        own_map(tmp_path / name)
        (tmp_path / name / "own.yaml").write_text("like: chefbot_lidar\nname: own\n")
        keys.add(run_specs(tiny(world="plan.yaml", robot="own.yaml"), tmp_path / name, [1])[0].key)
        keys.add(
            run_specs(
                tiny(world=str(tmp_path / name / "plan.yaml"), robot=str(tmp_path / name / "own.yaml")),
                Path(),
                [1],
            )[0].key
        )
    assert len(keys) == 1


def test_the_robot_is_in_the_key_and_not_its_file(tmp_path: Path) -> None:
    keys = []
    for speed in ("0.25 m/s", "0.25 m/s", "0.2 m/s"):
        (tmp_path / "own.yaml").write_text(
            f"like: chefbot_lidar\nname: own\ndrive:\n  max_speed: {speed}\n# {len(keys)}\n"
        )
        keys.append(run_specs(tiny(robot="own.yaml"), tmp_path, [1])[0].key)
    assert keys[0] == keys[1] != keys[2]


def test_a_log_and_its_relations_may_share_a_name(tmp_path: Path) -> None:
    for folder in ("logs", "relations"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "intel.txt").write_text(folder)
    task = MapLogTask(log="logs/intel.txt", relations="relations/intel.txt")
    spec = run_specs(tiny(task=task), tmp_path, [1])[0]
    assert isinstance(spec.scenario.task, MapLogTask)
    assert spec.files[spec.scenario.task.log] == b"logs"
    assert spec.files[spec.scenario.task.relations] == b"relations"


def test_a_spec_is_the_same_after_its_way_to_a_worker() -> None:
    spec = tiny_specs([1])[0]
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(spec), type=RunSpec) == spec
