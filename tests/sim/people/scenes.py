"""Small drawn worlds with people in them, without physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.buildings.world_file import Chair, Door, Route
from chefbot.maths.se2 import SE2
from chefbot.sim.people.people import Habitat, RobotCircle, SimulatedPeople
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS, chair_shapes
from chefbot.sim.world.shapes import SimulatedShape, box

PERIOD = 0.04
ROBOT_RADIUS = 0.2
Wall = tuple[float, float, float, float]


def wall(name: str, x0: float, y0: float, x1: float, y1: float) -> SimulatedShape:
    """Return a wall of 0.1 m along an axis."""
    size = (abs(x1 - x0) + 0.1, abs(y1 - y0) + 0.1, 2.5)
    return box(name, SE2((x0 + x1) / 2, (y0 + y1) / 2, 0.0), 0.0, size, (200, 200, 200))


def room(width: float, depth: float, inner: Iterable[Wall] = ()) -> list[SimulatedShape]:
    """Return a room from (0, 0) to (width, depth) with inner walls."""
    outer = [(0, 0, width, 0), (0, depth, width, depth), (0, 0, 0, depth), (width, 0, width, depth)]
    return [wall(f"wall_{i}", *ends) for i, ends in enumerate([*outer, *inner])]


def two_rooms(gap: float = 0.9) -> list[SimulatedShape]:
    """Return two rooms of 4 by 4 m side by side, with a doorway of `gap` metres in the middle of the wall."""
    return room(8.0, 4.0, [(4.0, 0.0, 4.0, 2.0 - gap / 2 - 0.05), (4.0, 2.0 + gap / 2 + 0.05, 4.0, 4.0)])


def chair(x: float, y: float, yaw: float) -> list[SimulatedShape]:
    """Return a chair that faces along `yaw`."""
    return chair_shapes(Chair(x=x, y=y, yaw=yaw), "chair_0")


class Scene:
    """People in a drawn world, and a robot that drives as the test commands."""

    def __init__(
        self,
        solids: Sequence[SimulatedShape],
        bounds: Wall,
        spec: PeopleSpec,
        seed: int = 1,
        robot: tuple[float, float] = (0.6, 0.6),
        doors: Sequence[Door] = (),
        routes: Sequence[Route] = (),
    ) -> None:
        self.doors = [MovingDoor(door) for door in doors]
        self.robot = RobotCircle(*robot, 1.0, 0.0, ROBOT_RADIUS)
        habitat = Habitat(solids, bounds, self.doors, routes)
        self.people = SimulatedPeople(spec, habitat, self.robot, np.random.default_rng(seed))
        self.solids = [s for s in solids if s.name not in self._names_of_chairs()]

    def _names_of_chairs(self) -> set[str]:
        return {solid.name for one in self.people.movable for solid in one.solids}

    def put(self, number: int, x: float, y: float) -> None:
        """Put a person at a point."""
        self.people.walkers.position[number] = x, y

    def drive(self, x: float, y: float) -> None:
        """Move the robot to a point, towards which it then faces."""
        dx, dy = x - self.robot.x, y - self.robot.y
        length = math.hypot(dx, dy)
        front = (dx / length, dy / length) if length > 0 else (self.robot.ux, self.robot.uy)
        self.robot = RobotCircle(x, y, *front, ROBOT_RADIUS)

    def run(self, seconds: float, speed: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
        """Run while the robot drives with a velocity; return the positions (steps, n, 2)."""
        positions = []
        for _ in range(round(seconds / PERIOD)):
            occupants = [(self.robot.x, self.robot.y, ROBOT_RADIUS), *self.people.circles()]
            for door in self.doors:
                door.advance(PERIOD, occupants)
            if speed != (0.0, 0.0):
                self.drive(self.robot.x + speed[0] * PERIOD, self.robot.y + speed[1] * PERIOD)
            self.people.advance(PERIOD, self.robot)
            positions.append(self.people.walkers.position.copy())
        return np.array(positions)

    def to_robot(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gaps between bodies and the robot where it is now, m."""
        away = positions - np.array([self.robot.x, self.robot.y])
        return np.hypot(away[..., 0], away[..., 1]) - PERSON_RADIUS - ROBOT_RADIUS


def gaps_between(positions: NDArray[np.float64]) -> float:
    """Return the least distance of two people over all steps (steps, n, 2), m."""
    away = positions[:, :, None] - positions[:, None]
    distances = np.hypot(away[..., 0], away[..., 1])
    n = positions.shape[1]
    distances[:, np.arange(n), np.arange(n)] = math.inf
    return float(distances.min())


DECISION = 0.4
"""Time between two decisions of a person, s."""
Script = Generator[None, None, Any]


def person_of(one: Scene, number: int = 0) -> Any:
    return one.people._persons[number]


def mode(one: Scene, number: int = 0) -> int:
    return int(one.people.walkers.mode[number])


def aim(one: Scene, number: int = 0) -> tuple[float, float]:
    x, y = one.people.walkers.aim[number].tolist()
    return x, y


def drive(one: Scene, script: Script, each: Callable[[], None] = lambda: None, max_steps: int = 500) -> Any:
    """Let a script decide, with time but without steps between its decisions; return what it returns."""
    for _ in range(max_steps):
        try:
            next(script)
        except StopIteration as end:
            return end.value
        one.people.now += DECISION
        each()
    raise AssertionError("the script does not end")


def decide(one: Scene, script: Script, times: int = 1) -> None:
    for _ in range(times):
        next(script)
        one.people.now += DECISION
