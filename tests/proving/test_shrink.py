"""Smaller variants of a failing scenario, and the search for the smallest that fails in the same way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from zlib import crc32

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.proving_runs import a_record, tiny

from chefbot.buildings.parameters import KINDS, draw_numbers
from chefbot.buildings.people_spec import PeopleSpec
from chefbot.errors import UserError
from chefbot.proving import shrink as module
from chefbot.proving.record import RunRecord
from chefbot.proving.reductions import (
    EMPTY_NUMBERS,
    REDUCERS,
    TIME_AFTER_FAILURE,
    Reduction,
    emptier_building,
    fewer_faults,
    fewer_people,
    perfect_robot,
    shorter,
    smaller_task,
)
from chefbot.proving.scenario import Building, Scenario, parse_scenario
from chefbot.proving.scenario_tasks import DeliverTask, DriveRandomlyTask, ExploreTask, GoTask, PassDoorTask
from chefbot.proving.shrink import MAX_RUNS, failure_kind, regression_text, run_shrink, shrink
from chefbot.sim.faults.events import SensorFreeze, SensorStop

FAULTS = (
    SensorStop(at=1.0, sensor="lidar"),
    SensorFreeze(at=2.0, sensor="imu"),
    SensorStop(at=3.0, sensor="imu"),
)
FAILED = a_record(1, success=False)
TASKS = [
    GoTask(goals=4),
    DeliverTask(tables=3),
    DriveRandomlyTask(duration=200.0),
    ExploreTask(),
    PassDoorTask(),
]


def scenario(**changes) -> Scenario:
    return tiny(**{"task": GoTask(goals=3), "profile": "real", **changes})


def reductions(reducer, given: Scenario, record: RunRecord = FAILED) -> list[Scenario]:
    return [reduction.scenario for reduction in reducer(given, record)]


def people_of(one: Scenario) -> int:
    return one.people.count if isinstance(one.people, PeopleSpec) else one.people


def size(one: Scenario) -> tuple[float, ...]:
    """Return what can be made smaller: faults, people, goals or time, what is in the building, imperfections."""
    task = one.task
    amount = getattr(task, "goals", 0) + getattr(task, "tables", 0) + getattr(task, "duration", 0.0)
    numbers = one.world.numbers if isinstance(one.world, Building) else EMPTY_NUMBERS
    things = sum(numbers.get(name) != number for name, number in EMPTY_NUMBERS.items())
    people = people_of(one) if people_of(one) >= 0 else 99
    return len(one.faults), people, amount, things, one.profile != "perfect"


SCENARIOS = st.builds(
    scenario,
    faults=st.lists(st.sampled_from(FAULTS), max_size=4).map(tuple),
    people=st.one_of(st.integers(-1, 12), st.builds(PeopleSpec, count=st.integers(0, 12))),
    task=st.sampled_from(TASKS),
    world=st.sampled_from(["room", Building(kind="home"), Building(kind="office", numbers={"clutter": 0.5})]),
    profile=st.sampled_from(["perfect", "real"]),
)


@given(SCENARIOS)
@settings(max_examples=60)
def test_every_reduction_is_smaller_in_one_respect(given_scenario: Scenario) -> None:
    for reducer in REDUCERS:
        for smaller in reductions(reducer, given_scenario):
            before, after = size(given_scenario), size(smaller)
            assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
            assert all(a <= b for a, b in zip(after, before, strict=True))


def test_without_faults_comes_before_each_alone_and_all_but_one() -> None:
    found = [one.faults for one in reductions(fewer_faults, scenario(faults=FAULTS))]
    a, b, c = FAULTS
    assert found == [(), (a,), (b,), (c,), (b, c), (a, c), (a, b)]
    assert [one.faults for one in reductions(fewer_faults, scenario(faults=FAULTS[:2]))] == [(), (a,), (b,)]
    assert [one.faults for one in reductions(fewer_faults, scenario(faults=FAULTS[:1]))] == [()]
    assert reductions(fewer_faults, scenario()) == []


@pytest.mark.parametrize(("count", "fewer"), [(0, []), (1, [0]), (3, [0, 1, 2]), (12, [0, 1, 2, 4, 6])])
def test_nobody_comes_before_some_people(count: int, fewer: list[int]) -> None:
    assert [people_of(one) for one in reductions(fewer_people, scenario(people=count))] == fewer
    spec = PeopleSpec(count=count, follow=0.5)
    found = reductions(fewer_people, scenario(people=spec))
    assert [one.people for one in found] == [PeopleSpec(count=n, follow=0.5) for n in fewer]


def test_the_people_of_a_world_may_be_left_out() -> None:
    assert [people_of(one) for one in reductions(fewer_people, scenario(people=-1))] == [0, 1, 2, 4, 6]


def test_a_task_has_one_goal_or_half_the_time() -> None:
    tasks = [reductions(smaller_task, scenario(task=task)) for task in TASKS]
    assert [[one.task for one in found] for found in tasks] == [
        [GoTask(goals=1)],
        [DeliverTask(tables=1)],
        [DriveRandomlyTask(duration=100.0)],
        [],
        [],
    ]
    assert reductions(smaller_task, scenario(task=GoTask(goals=1))) == []
    assert reductions(smaller_task, scenario(task=DriveRandomlyTask(duration=20.0))) == []


def test_a_building_is_emptied_at_once_or_bit_by_bit() -> None:
    building = Building(kind="home", numbers={"clutter": 0.5, "boards": 0, "rooms": 3.0})
    first, *single = reductions(emptier_building, scenario(world=building))
    assert isinstance(first.world, Building) and first.world.numbers == {"rooms": 3.0, **EMPTY_NUMBERS}
    changed = [one.world.numbers for one in single if isinstance(one.world, Building)]
    assert [set(numbers.items()) - set(building.numbers.items()) for numbers in changed] == [
        {(name, number)} for name, number in EMPTY_NUMBERS.items() if name != "boards"
    ]
    assert reductions(emptier_building, first) == []
    assert reductions(emptier_building, scenario(world="room")) == []


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_building_may_be_emptied(kind: str) -> None:
    draw_numbers(kind, EMPTY_NUMBERS, np.random.default_rng(1))


def test_a_drive_ends_soon_after_its_last_incident() -> None:
    driving = scenario(task=DriveRandomlyTask(duration=200.0))
    record = a_record(
        1, success=False, incidents=[(3.0, 0.0, 0.0, "a"), (41.2, 0.0, 0.0, "b"), (7.0, 0.0, 0.0, "c")]
    )
    (one,) = reductions(shorter, driving, record)
    assert one.task == DriveRandomlyTask(duration=round(41.2 + TIME_AFTER_FAILURE))
    (late,) = reductions(shorter, driving, a_record(1, success=False, incidents=[], sim_time=60.0))
    assert late.task == DriveRandomlyTask(duration=65.0)
    assert reductions(shorter, driving, a_record(1, success=False, incidents=[(199.0, 0.0, 0.0, "a")])) == []
    assert reductions(shorter, scenario(), record) == []


def test_a_perfect_robot_is_not_made_perfect_again() -> None:
    (one,) = reductions(perfect_robot, scenario())
    assert one.profile == "perfect" and reductions(perfect_robot, one) == []


# The search

CULPRIT = FAULTS[1]


def fails(one: Scenario) -> bool:
    """A run that fails with one of the faults and at least two people."""
    return CULPRIT in one.faults and people_of(one) >= 2


def make_of(condition: Callable[[Scenario], bool], made: list[Scenario], failure: str = "3 collisions"):
    def make(one: Scenario) -> RunRecord:
        made.append(one)
        return a_record(1, success=not condition(one), failure=failure if condition(one) else "")

    return make


def test_what_does_not_matter_is_left_out() -> None:
    made: list[Scenario] = []
    steps: list[tuple[str, bool]] = []
    large = scenario(faults=FAULTS, people=12, world=Building(kind="home"))
    small, record, runs = shrink(
        large,
        a_record(1, success=False, failure="2 collisions"),
        make_of(fails, made),
        lambda r, f: steps.append((r.what, f)),
    )
    assert (small.faults, small.people, small.profile) == ((CULPRIT,), 2, "perfect")
    assert small.task == GoTask(goals=1)
    assert isinstance(small.world, Building) and small.world.numbers == EMPTY_NUMBERS
    assert record.failure == "3 collisions" and runs == 1 + len(made) == 1 + len(steps)
    assert [what for what, still in steps if still][:2] == ["with one fault", "2 people"]


def test_another_failure_is_not_the_same() -> None:
    first = a_record(1, success=False, failure="not reached: table_1")
    given_scenario, made = scenario(faults=FAULTS, people=4), list[Scenario]()
    make = make_of(lambda _: True, made, "the robot was not localized after 400 s")
    assert shrink(given_scenario, first, make, lambda *_: None)[:2] == (given_scenario, first)


def test_a_run_that_succeeds_never_fails_in_the_same_way() -> None:
    first, given_scenario = a_record(1, success=False, failure="300"), scenario(people=4)
    assert failure_kind(first) == failure_kind(a_record(1))
    make = make_of(lambda _: False, [])
    assert shrink(given_scenario, first, make, lambda *_: None)[:2] == (given_scenario, first)


@given(SCENARIOS, st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_the_result_of_the_bounded_search_is_a_failing_scenario(given_scenario: Scenario, coin: int) -> None:
    def condition(one: Scenario) -> bool:
        return one == given_scenario or bool((coin >> crc32(msgspec.json.encode(one)) % 32) & 1)

    made: list[Scenario] = []
    small, record, runs = shrink(
        given_scenario, FAILED, make_of(condition, made, FAILED.failure), lambda *_: None
    )
    assert condition(small) and not record.success
    assert runs == 1 + len(made) <= MAX_RUNS
    assert all(a <= b for a, b in zip(size(small), size(given_scenario), strict=True))


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ("3 collisions", "17 collisions", True),
        ("not reached: table_1", "not reached: table_2, table_3", True),
        ("the robot was not localized after 400 s", "the robot was not localized after 12 s", True),
        ("collisions 3 is above 0; not reached: home", "not reached: bar", True),
        ("Traceback\n  line 7\nValueError: bad 3", "ValueError: bad 4", True),
        ("not reached: table_1", "the robot did not return home", False),
        ("3 collisions", "", False),
    ],
)
def test_failures_are_alike_whatever_their_numbers_and_names(one: str, other: str, alike: bool) -> None:
    kinds = [failure_kind(a_record(1, success=False, failure=text)) for text in (one, other)]
    assert bool(kinds[0] & kinds[1]) == alike


def test_a_regression_is_a_scenario_that_is_known_to_fail() -> None:
    given_scenario = scenario(faults=FAULTS, people=PeopleSpec(count=2), claim=0.9, name="a" * 58)
    text = regression_text(
        given_scenario, a_record(7, success=False, failure="no: 'quoted' # text " + 400 * "x"), 7
    )
    kept = parse_scenario(text.encode(), "test")
    assert (kept.seeds, kept.claim, kept.name) == ("7", 0.0, "a" * 58 + "_7")
    assert kept.known_failure.startswith("no: 'quoted' # text") and len(kept.known_failure) == 300
    same = msgspec.structs.replace(
        kept, name=given_scenario.name, seeds=given_scenario.seeds, claim=0.9, known_failure=""
    )
    assert same == given_scenario


# The command


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> list[Scenario]:
    """Make runs that fail with the culprit and two people; return their scenarios."""
    made: list[Scenario] = []
    make = make_of(fails, made)
    monkeypatch.setattr(module, "compile_kernels", lambda _: None)
    monkeypatch.setattr(module, "_made", lambda one, _: make(one))
    return made


def written(folder: Path, people: int) -> str:
    path = folder / "crowded.yaml"
    path.write_text(
        f"name: crowded\nworld: room\npeople: {people}\ntask: {{type: go}}\n"
        "faults: [{at: 2, fault: freeze, sensor: imu}]\n"
    )
    return str(path)


def test_the_small_scenario_is_written_beside_the_results(tmp_path: Path, tool: list[Scenario]) -> None:
    assert run_shrink(f"{written(tmp_path, 8)}:12", tmp_path / "out") == 0
    kept = parse_scenario((tmp_path / "out" / "crowded_12.yaml").read_bytes(), "test")
    assert (kept.people, kept.seeds, kept.known_failure) == (2, "12", "3 collisions")
    assert fails(kept)


def test_a_run_that_succeeds_cannot_be_made_smaller(tmp_path: Path, tool: list[Scenario]) -> None:
    with pytest.raises(UserError, match="with seed 12 succeeds"):
        run_shrink(f"{written(tmp_path, 1)}:12", tmp_path)
    assert len(tool) == 1


@pytest.mark.parametrize("run", ["crowd", "crowd:", ":7", "crowd:x", "crowd:-1", ""])
def test_a_run_is_named_by_scenario_and_seed(run: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match="name a scenario and a seed"):
        run_shrink(run, tmp_path)


def test_reductions_name_what_was_left_out() -> None:
    found = [one for reducer in REDUCERS for one in reducer(scenario(faults=FAULTS, people=3), FAILED)]
    assert all(isinstance(one, Reduction) and one.what for one in found)
    assert {"without faults", "0 people", "one goal", "a perfect robot"} <= {one.what for one in found}
