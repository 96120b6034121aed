"""The task `pass_door`: its passages, its events, and a robot that gets through blocked doors."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.proving.run import make_run
from chefbot.proving.run_spec import run_specs
from chefbot.proving.scenario import load_scenario
from chefbot.proving.scenario_tasks import PassDoorTask
from chefbot.proving.tasks.pass_door import EVENTS, draw_passage, event_of
from chefbot.robot.load import load_robot
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
SEEDS = [1, 3, 5, 7]
"""An event each."""
ROOMS = {"kitchen_door": ("kitchen",), "door_101": ("room_101",), "door_102": ("room_102",)}


@pytest.mark.slow
def test_a_passage_leads_through_the_only_door_of_a_room() -> None:
    world, doors = load_world("hotel"), Counter[str]()
    for seed in range(24):
        passage = draw_passage(world, ROBOT, seed)
        doors[passage.door.name] += 1
        inside = passage.goal in ROOMS[passage.door.name]
        start = next(name for name, pose in world.places.items() if pose == passage.start)
        assert inside != (start in ROOMS[passage.door.name])
    assert set(doors) == set(ROOMS)
    assert draw_passage(world, ROBOT, 5) == draw_passage(world, ROBOT, 5)


def test_a_world_without_such_a_door_is_refused() -> None:
    with pytest.raises(UserError, match="has no door with places on both sides"):
        draw_passage(load_world("room"), ROBOT, 1)


@pytest.mark.parametrize("first", [0, 1])
def test_odd_and_even_seeds_have_all_events(first: int) -> None:
    events = Counter(event_of(PassDoorTask(), seed) for seed in range(first, 40, 2))
    assert events == dict.fromkeys(EVENTS, 5)
    assert event_of(PassDoorTask(event="close"), first) == "close"


def pass_doors(folder: Path, seeds: list[int]) -> dict[str, list[float]]:
    """Run the scenario `doors` with these seeds, in which no goal is given up, and return its figures."""
    records = []
    for spec in run_specs(load_scenario("doors"), folder, seeds):
        (folder / str(spec.seed)).mkdir()
        records.append(make_run(spec, folder / str(spec.seed)))
    figures = {name: [one.figures[name] for one in records] for name in records[0].figures}
    assert figures["goals_reached"] == [1.0] * len(seeds), [one.failure for one in records]
    assert max(figures["given_up"]) == max(figures["collisions"]) == 0.0
    assert max(figures["request_delay"]) <= 10.0
    return figures


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_a_robot_requests_waits_and_gets_through(tmp_path: Path, seed: int) -> None:
    """Two who talk, a crowd of four, a closed door, one who blocks: never given up."""
    pass_doors(tmp_path, [seed])


@pytest.mark.long
def test_a_robot_is_soon_through_a_free_door_and_waits_beside_it(tmp_path: Path) -> None:
    """A crowd that closes in while it passes the doorway may hold it up there, in one of four runs at most."""
    figures = pass_doors(tmp_path, SEEDS)
    assert sorted(figures["passage_delay"])[len(SEEDS) // 2] <= 15.0
    assert sum(share > 0.02 for share in figures["doorway_share"]) <= len(SEEDS) // 4
