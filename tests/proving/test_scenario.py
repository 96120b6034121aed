"""Scenario files: what is valid, one sentence for what is not, and the text of a scenario read back."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.support.proving_runs import DRIVE, tiny

from chefbot.buildings.parameters import draw_numbers
from chefbot.config_text import plain_sections, yaml_text
from chefbot.errors import ChefbotError, UserError
from chefbot.proving.figures import FIGURES
from chefbot.proving.results_folder import SCENARIOS, Request, ResultsFolder
from chefbot.proving.run import broken_criteria
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import (
    Building,
    Scenario,
    built_in_scenarios,
    is_judging,
    load_scenario,
    parse_scenario,
    parse_seeds,
)
from chefbot.proving.scenario_tasks import (
    TASKS,
    Bounds,
    DeliverTask,
    DriveRandomlyTask,
    ExploreTask,
    GoTask,
    LocalizeTask,
    MapLogTask,
    RunLimits,
    task_name,
)

BASE = "name: a\ntask: {type: go}\n"


def written(text: str) -> Scenario:
    return parse_scenario(text.encode(), "scenario a.yaml")


@pytest.mark.parametrize("name", built_in_scenarios())
def test_built_in_scenarios_name_what_exists(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description.endswith(".")
    spec = run_specs(scenario, Path(), [1])[0]  # loads robot and world
    assert spec.files == {}
    if isinstance(scenario.world, Building):
        numbers = draw_numbers(scenario.world.kind, scenario.world.numbers, np.random.default_rng(1))
        assert numbers.items() >= scenario.world.numbers.items()


def test_built_in_scenarios_try_every_simulated_task() -> None:
    used = {type(load_scenario(name).task) for name in built_in_scenarios()}
    assert used == set(TASKS) - {MapLogTask}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the file must be a section with keys, not nothing"),
        ("[]", "the file must be a section"),
        ("name: a\n", "'task' is missing"),
        (BASE + "sseds: 1..3\n", "unknown key 'sseds' .did you mean 'seeds'"),
        (BASE + "name: b\n", "line 3: not valid YAML: 'name' is given twice"),
        ("name: Big One\ntask: {type: go}\n", "name: must be a text of the form"),
        ("name: a\ntask: explore\n", "task must be a section with the key 'type'"),
        ("name: a\ntask: {}\n", "task must be a section with the key 'type'"),
        ("name: a\ntask: {type: [1]}\n", r"task.type: unknown type '\[1\]'"),
        ("name: a\ntask: {type: exlpore}\n", "task.type: unknown type 'exlpore' .did you mean 'explore'"),
        ("name: a\ntask: {type: go, gaols: 2}\n", "unknown key 'task.gaols' .did you mean 'goals'"),
        ("name: a\ntask: {type: go, goals: 0}\n", "task.goals: 0 must be at least 1"),
        ("name: a\ntask: {type: map_log}\n", "'task.log' is missing"),
        ("name: a\ntask: {type: localize, initial_pose: maybe}\n", "unknown value 'maybe'"),
        (BASE + "criteria: {colisions: {max: 0}}\n", "no figure 'colisions' .did you mean 'collisions'"),
        (BASE + "criteria: {collisions: {}}\n", "criteria: collisions needs a min"),
        (BASE + "criteria: {explored: {min: 0.9, max: 0.1}}\n", "criteria: explored needs a min"),
        (BASE + "criteria: {collisions: {most: 0}}\n", "criteria: collisions: unknown key 'most'"),
        (BASE + "world: {kind: offfice}\n", "world: there is no kind of building 'offfice'"),
        (BASE + "world: {kind: office, numbers: {widht: 9}}\n", "world: .*has no number 'widht'"),
        (BASE + "world: {kind: office, numbers: {width: 9000}}\n", "world: width"),
        (BASE + "world: {}\n", "'world.kind' is missing"),
        (BASE + "start: [1, 2]\n", "start: must be three numbers"),
        (BASE + "start: [.nan, 1, 2]\n", "nan is not a finite number"),
        (BASE + "people: 51\n", "people: 51 must be at most 50"),
        (BASE + "profile: rael\n", "did you mean 'real'"),
        (BASE + "claim: 1.5\n", "claim: 1.5 must be at most 1"),
        (BASE + "limits: {memory: 10}\n", "limits.memory: 10 must be at least 300"),
        (BASE + "limits: {time: 0 s}\n", "limits.time: 0 s must be above 0 s"),
        (BASE + "limits: {time: 5 m}\n", "limits.time"),
        (BASE + "seeds: 1-4\n", "seeds '1-4': give seeds as 1..20, 7 or 1..5,9"),
    ],
)
def test_a_bad_scenario_has_one_sentence_with_its_file(text: str, sentence: str) -> None:
    with pytest.raises(ChefbotError, match=sentence) as caught:
        written(text)
    assert str(caught.value).startswith("scenario a.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("explore_hom", "no scenario is called 'explore_hom' .did you mean 'explore_home'"),
        ("absent.yaml", "scenario absent.yaml does not exist"),
    ],
)
def test_an_unknown_scenario_is_reported_in_one_sentence(name: str, sentence: str) -> None:
    with pytest.raises(ChefbotError, match=sentence):
        load_scenario(name)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"world": "hotle"}, "hotle"),
        ({"world": "absent.yaml"}, "absent.yaml does not exist"),
        ({"robot": "chefbt"}, "chefbt"),
        ({"robot": "absent.yaml"}, "absent.yaml does not exist"),
        ({"task": MapLogTask(log="absent.log")}, "absent.log does not exist"),
        ({"world": "hotel", "start": [99.0, 0.0, 0.0]}, "start"),
    ],
)
def test_what_a_scenario_names_must_exist(change: dict[str, Any], sentence: str, tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match=sentence) as caught:
        run_specs(tiny(**change), tmp_path, [1])
    assert "\n" not in str(caught.value)


# Seeds

RANGES = st.lists(st.tuples(st.integers(0, 2**31 - 300), st.integers(0, 200)), min_size=1, max_size=5)


@given(RANGES, st.sampled_from(["", " "]))
def test_seeds_are_those_of_all_ranges_in_order(ranges: list[tuple[int, int]], gap: str) -> None:
    parts = [f"{first}{gap}..{gap}{first + more}" if more else f"{gap}{first}" for first, more in ranges]
    expected = {seed for first, more in ranges for seed in range(first, first + more + 1)}
    assert parse_seeds(f"{gap},".join(parts), "--seeds") == sorted(expected)


@given(st.text(max_size=20))
@example("1 2")
@example("9" * 5000)
@example("\u0663")
@example("1..100001")
@example("2147483648")
@example("5..1")
@example("")
def test_any_other_text_of_seeds_is_reported_in_one_sentence(text: str) -> None:
    try:
        seeds = parse_seeds(text, "--seeds")
    except UserError as error:
        assert str(error).startswith("--seeds ")
        assert len(str(error)) < 700
    else:
        assert re.fullmatch(r"[0-9., ]+", re.sub(r"\s", " ", text))
        assert not re.search(r"[0-9]\s+[0-9]", text)
        assert seeds == sorted(set(seeds)) != []


@given(st.integers(0, 2**31))
def test_odd_seeds_judge_and_even_ones_do_not(seed: int) -> None:
    assert is_judging(seed) == bool(seed & 1)


# Criteria

BOUND = st.none() | st.floats(-100, 100)


@given(BOUND, BOUND, st.floats(-200, 200))
def test_a_figure_outside_its_bounds_is_named(low: float | None, high: float | None, value: float) -> None:
    bounds = Bounds(min=low, max=high)
    inside = (low is None or low <= value) and (high is None or value <= high)
    assert bounds.violated_by(value) == (not inside)
    sentence = broken_criteria(tiny(criteria={"explored": bounds}), {"explored": value})
    assert bool(sentence) == (not inside)
    if sentence:
        wanted = f"at least {low:g}" if low is not None and value < low else f"at most {high:g}"
        assert sentence == f"explored is {value:.3g}, expected {wanted}" or not bounds.can_be_kept


@given(BOUND, BOUND)
def test_bounds_need_a_value_that_keeps_them(low: float | None, high: float | None) -> None:
    bounds = Bounds(min=low, max=high)
    some = low if low is not None else high
    assert bounds.can_be_kept == (some is not None and not bounds.violated_by(some))


@pytest.mark.parametrize("bounds", [Bounds(max=0.0), Bounds(min=0.0), Bounds(min=0.0, max=1.0)])
def test_a_figure_that_was_not_measured_is_not_a_success(bounds: Bounds) -> None:
    assert broken_criteria(tiny(criteria={"explored": bounds}), {}).startswith(
        "explored is nan, expected at "
    )


def test_a_log_is_judged_by_collisions_only_on_request() -> None:
    text = "name: a\ntask: {type: map_log, log: a.log}\n"
    assert written(text).criteria == {}
    assert set(written(text + "criteria: {collisions: {max: 1}}\n").criteria) == {"collisions"}
    assert written(BASE).criteria == {"collisions": Bounds(max=0)}


# Text

NUMBERS = st.integers(-(10**6), 10**6).map(lambda n: n / 1000)
POSITIVE = st.integers(1, 10**6).map(lambda n: n / 100)
TEXTS = st.text(st.characters(codec="utf-8"), max_size=30)
TASK = st.one_of(
    st.just(ExploreTask()),
    st.builds(MapLogTask, log=st.just("/logs/a.log"), particles=st.integers(1, 1000), max_range=POSITIVE),
    st.builds(LocalizeTask, initial_pose=st.sampled_from(["unknown", "approximate"])),
    st.builds(GoTask, goals=st.integers(1, 100)),
    st.builds(DeliverTask, tables=st.integers(1, 100), map=st.sampled_from(["true", "explored"])),
    st.builds(DriveRandomlyTask, duration=POSITIVE, careful=st.booleans()),
)
BOUNDS = st.builds(Bounds, min=st.none() | NUMBERS, max=st.none() | NUMBERS).filter(lambda b: b.can_be_kept)
ANY_SCENARIO = st.builds(
    Scenario,
    name=st.from_regex(r"[a-z0-9][a-z0-9_]{0,20}", fullmatch=True),
    description=TEXTS,
    world=st.sampled_from(["room", "/worlds/a.yaml", Building(kind="office")])
    | st.integers(60, 120).map(lambda n: Building(kind="corridors", numbers={"loop": float(n)})),
    robot=st.sampled_from(["chefbot", "chefbot_lidar", "/robots/a.yaml"]),
    profile=st.sampled_from(["perfect", "real", "assembled"]),
    start=st.none() | st.lists(NUMBERS, min_size=3, max_size=3),
    people=st.integers(-1, 50),
    task=TASK,
    limits=st.builds(RunLimits, time=POSITIVE, wall_time=POSITIVE, memory=st.integers(300, 9000).map(float)),
    criteria=st.dictionaries(st.sampled_from(list(FIGURES)), BOUNDS, max_size=3),
    claim=st.integers(0, 100).map(lambda n: n / 100),
    seeds=st.sampled_from(["1..20", "7", "1..3,9"]),
)


@given(ANY_SCENARIO)
@example(tiny(criteria={}))
def test_the_text_of_a_scenario_is_read_back(scenario: Scenario) -> None:
    text = yaml_text(plain_sections(scenario), "")
    assert parse_scenario(text.encode(), "scenario") == scenario


def test_every_task_is_tagged_in_the_text() -> None:
    for kind in TASKS:
        task = kind(log="a.log") if kind is MapLogTask else kind()
        text = yaml_text(plain_sections(tiny(task=task)), "")
        assert f"type: {task_name(kind)}\n" in text
        assert type(written(text).task) is kind


def test_a_scenario_kept_with_results_is_the_same_run(tmp_path: Path) -> None:
    here, results = tmp_path / "here", ResultsFolder(tmp_path / "results")
    here.mkdir()
    (here / "plan.yaml").write_text("name: plan\nplaces:\n  home: {x: 0 m, y: 0 m}\n")
    (here / "own.yaml").write_text("like: chefbot_lidar\nname: own\n")
    scenario = msgspec.structs.replace(written(DRIVE), world="plan.yaml", robot="own.yaml")
    results.create(Request(scenarios=[scenario], folders=[str(here)], seeds=[[1]]))
    kept = results.folder / SCENARIOS / "tiny.yaml"
    again = load_scenario(str(kept))
    assert again.world == str(here / "plan.yaml")
    keys = [run_specs(one, base, [1])[0].key for one, base in ((scenario, here), (again, kept.parent))]
    assert keys[0] == keys[1]


@pytest.mark.parametrize("bounds", ["3", "{max: true}", "{min: []}"])
def test_a_wrong_bound_is_named_with_its_figure(bounds: str) -> None:
    text = f"name: x\ntask: {{type: go}}\ncriteria: {{collisions: {{max: 0}}, time: {bounds}}}\n"
    with pytest.raises(ChefbotError, match="criteria: time: "):
        parse_scenario(text.encode(), "scenario x")
