"""Task `pass_door`: drive through the only door of a room while people or its leaf block it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import msgspec
import numpy as np

from chefbot.buildings.world_file import Door
from chefbot.errors import UserError
from chefbot.maths.grid import FREE, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.std_msgs import String
from chefbot.proving.doorways import DoorwayObserver
from chefbot.proving.scenario_tasks import PassDoorTask
from chefbot.proving.simulated_run import SimulatedRun, TaskFailedError
from chefbot.proving.tasks.go import drive_to
from chefbot.proving.tasks.localize import start_localized
from chefbot.robot.spec import Robot
from chefbot.runtime.loop import Publication
from chefbot.sim.world.doors import closed_middle
from chefbot.sim.world.floor_plan import reachable
from chefbot.sim.world.world import World

EVENTS = ("talk", "crowd", "close", "block")
TALKERS = 2
ROUTE_END_DISTANCE = 9.0
"""Distance to the door up to which start and goal are drawn, m, if a place is so near."""
GATHERING_TIME = 60.0
"""Time that people get to reach the door before the robot sets out, s."""
ARRIVAL_DISTANCE = 3.0
"""Distance to the door at which the robot has arrived at it, m."""
SIDE_DISTANCE = 0.6
"""Distance to the middle of a door at which one side of it is looked at, m."""
PATIENCE = 300.0
"""Time before which no goal may be given up, s."""


class Passage(NamedTuple):
    """A door, the pose on one side of it where the robot starts, and the place on the other where it goes.

    side: sign of x of the goal's side, in the frame of the door's middle.
    """

    door: Door
    start: SE2
    goal: str
    side: float


def draw_passage(world: World, robot: Robot, seed: int) -> Passage:
    """Return a passage through a door without a path around it, drawn by the seed, or raise UserError."""
    rng = np.random.default_rng([seed, 0xD002])
    floor = reachable(world, robot)
    sided = []
    for door in world.doors:
        doors = tuple(_opened(one, 0.0) if one is door else one for one in world.doors)
        closed = reachable(replace(world, doors=doors), robot)
        sides = _sides(world, floor, closed)
        if all(sides):
            sided.append((door, sides, closed))
    if not sided:
        raise UserError(f"world {world.name} has no door with places on both sides and no path around it")
    door, sides, closed = sided[int(rng.integers(len(sided)))]
    one, other = (sides[i] for i in rng.permutation(2))
    start, goal = (_near_place(world, door, names, rng) for names in (one, other))
    ahead = _is_free(closed, closed_middle(door) @ SE2(SIDE_DISTANCE, 0.0, 0.0))
    side = 1.0 if ahead == _is_free(closed, world.places[goal]) else -1.0
    return Passage(door, world.places[start], goal, side)


def _opened(door: Door, fraction: float) -> Door:
    """Return the door opened by a fraction, 0..1."""
    return msgspec.structs.replace(door, open=fraction)


def _sides(world: World, floor: Grid, closed: Grid) -> tuple[list[str], list[str]]:
    """Return the places on the two sides of what divides the floor when it is closed, in one order."""
    names = sorted(name for name, pose in world.places.items() if name != "home" and _is_free(floor, pose))
    here = [name for name in names if _is_free(closed, world.places[name])]
    there = [name for name in names if name not in here]
    return (here, there) if here[:1] < there[:1] else (there, here)


def _is_free(floor: Grid, pose: SE2) -> bool:
    row, column = floor.cell(pose.x, pose.y)
    return bool(floor.cells[row, column] == FREE)


def _near_place(world: World, door: Door, names: list[str], rng: np.random.Generator) -> str:
    """Draw one of the places near the door, else take the nearest one."""
    middle = closed_middle(door)
    near = [name for name in names if world.places[name].distance(middle) <= ROUTE_END_DISTANCE]
    if not near:
        return min(names, key=lambda name: world.places[name].distance(middle))
    return near[int(rng.integers(len(near)))]


def event_of(task: PassDoorTask, seed: int) -> str:
    """Return what blocks the door in a run: odd and even seeds cover all events equally."""
    return EVENTS[seed // 2 % len(EVENTS)] if task.event == "any" else task.event


def pass_door(run: SimulatedRun) -> None:
    """Localize, let people or the leaf block the door, and drive to the place behind it."""
    task = run.scenario.task
    assert isinstance(task, PassDoorTask)
    passage, event = draw_passage(run.world, run.system.robot, run.seed), event_of(task, run.seed)
    start_localized(run, run.true_map(), unknown=False)
    observer = DoorwayObserver(run, passage.door, passage.side)
    run.system.loop.add_observer(observer)
    if event != "close":
        _gather(run, observer, {"talk": TALKERS, "crowd": task.crowd}.get(event, 1))
    hold = _Hold(run, observer, event, task.hold)
    run.system.loop.add_observer(hold)
    reached = drive_to(run, passage.goal)
    run.figures.update(observer.figures(reached, PATIENCE))
    if not reached:
        raise TaskFailedError(
            f"{event} in {passage.door.name}: {passage.goal} was not reached: {run.goals[-1].reason}"
        )


def _gather(run: SimulatedRun, observer: DoorwayObserver, number: int) -> None:
    """Let people go to the door, and wait until they stand in it."""
    run.publish("simulation/people", String(f"meet {observer.door.name} {number}"))
    run.run_until(
        lambda: observer.people_within(1.2) >= min(number, TALKERS), "no one came to the door", GATHERING_TIME
    )


class _Hold:
    """Lets the event begin or end by the robot's position: an observer."""

    def __init__(self, run: SimulatedRun, observer: DoorwayObserver, event: str, seconds: float) -> None:
        self._run, self._observer, self._event, self._seconds = run, observer, event, seconds
        self._since: float | None = None
        self._released = False
        observer.blocks = event != "close"

    def __call__(self, publication: Publication) -> None:
        """Begin as soon as the robot is near or held up, and end after the time."""
        run, observer = self._run, self._observer
        if self._released or publication.topic != "ground_truth":
            return
        if self._since is None:
            if observer.distance <= ARRIVAL_DISTANCE or observer.held_up_at < math.inf:
                self._since, observer.blocks = run.time, True
                if self._event in _BEGIN:
                    run.publish(*_request(_BEGIN[self._event], observer.door.name))
        elif run.time - self._since >= self._seconds:
            self._released = observer.released = True
            run.publish(*_request(_END[self._event], observer.door.name))


_LEAVE = ("simulation/people", "leave")
_BEGIN = {"close": ("simulation/door", "close {door}"), "block": ("simulation/people", "block")}
_END = {"talk": _LEAVE, "crowd": _LEAVE, "block": _LEAVE, "close": ("simulation/door", "open {door}")}


def _request(request: tuple[str, str], door: str) -> tuple[str, String]:
    topic, text = request
    return topic, String(text.format(door=door))
