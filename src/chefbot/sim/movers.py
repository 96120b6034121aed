"""Everything that moves in a world except the robot: doors, people, and the chairs that people use."""

from __future__ import annotations

import math
from typing import Any

from numpy.random import Generator

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.sim.people.bodies import Bodies, poses_of, write_poses
from chefbot.sim.people.people import Habitat, RobotCircle, SimulatedPeople
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.floor import over_holes
from chefbot.sim.world.furniture import PERSON_HEIGHT
from chefbot.sim.world.shapes import (
    OccupiedCircle,
    ShapeArrays,
    SimulatedShape,
    concatenate,
    shape_arrays,
)
from chefbot.sim.world.world import World
from chefbot.sim.world.world_mjcf import MocapBody


class Movers:
    """Doors, chairs and people of a world, in this order; each avoids the current positions of the others.

    fixed: solids of the world that never move: all but the chairs that these people use. Raises UserError if there
    is no room for the people.
    """

    def __init__(self, world: World, spec: PeopleSpec, robot: RobotCircle, rng: Generator) -> None:
        self.doors = {door.name: MovingDoor(door) for door in world.doors}
        self._people: SimulatedPeople | None = None
        self._still: ShapeArrays | None = None
        self._bodies = Bodies(spec.count)
        self.fixed = world.static
        if spec.count:
            solids = (*world.static, *over_holes(world.holes, PERSON_HEIGHT))
            habitat = Habitat(solids, world.bounds, tuple(self.doors.values()), world.routes)
            self._people = SimulatedPeople(spec, habitat, robot, rng)
            movable = {solid for chair in self._people.movable for solid in chair.solids}
            self.fixed = tuple(solid for solid in world.static if solid not in movable)

    def advance(self, duration: float, robot: RobotCircle, data: Any) -> None:
        """Advance all by `duration` s and write their poses into MuJoCo's data."""
        moving_doors = [door for door in self.doors.values() if door.moving]
        moved = 0
        if moving_doors:
            occupants = [(robot.x, robot.y, robot.radius), *self.people_circles()]
            moved = sum(door.advance(duration, occupants) for door in moving_doors)
        if self._people is not None:
            moved += self._people.advance(duration, robot)
            self._write_people(self._people, data)
        if moved:
            self._write_doors_and_chairs(data)

    def write(self, data: Any) -> None:
        """Write the poses of all into MuJoCo's data."""
        self._write_doors_and_chairs(data)
        if self._people is not None:
            self._write_people(self._people, data)

    def mocap_bodies(self) -> list[MocapBody]:
        """Return all as bodies with their poses now."""
        people = zip(self._bodies.shapes, self.people_poses(), strict=True)
        persons = [MocapBody(f"person_{i}", shapes, pose) for i, (shapes, pose) in enumerate(people)]
        return self._doors_and_chairs() + persons

    def shapes(self) -> ShapeArrays:
        """Return the solids of all where they are now."""
        if self._still is None:
            self._still = shape_arrays(self.doors_and_chairs())
        if self._people is None:
            return self._still
        return concatenate(self._still, self._bodies.arrays(self._people.walkers))

    def doors_and_chairs(self) -> list[SimulatedShape]:
        """Return the solids of doors and of chairs that people use, where they are now."""
        return [shape.transformed(mover.pose) for mover in self._doors_and_chairs() for shape in mover.shapes]

    def people_poses(self) -> list[SE2]:
        """Return the poses of all people, x forward."""
        return [] if self._people is None else poses_of(self._people.walkers)

    def people_circles(self) -> list[OccupiedCircle]:
        """Return the floor areas that the people occupy."""
        return [] if self._people is None else self._people.circles()

    def request(self, text: str) -> None:
        """Let people do what somebody asks for. Raises UserError if they cannot, or if there are none."""
        if self._people is None:
            raise UserError("there are no people in this world")
        self._people.request(text)

    def add_solid(self, solid: SimulatedShape) -> None:
        """Let people see a new solid that stays where it is."""
        if self._people is not None:
            self._people.add_solid(solid)

    def _doors_and_chairs(self) -> list[MocapBody]:
        doors = [MocapBody(name, (door.leaf,), door.pose) for name, door in self.doors.items()]
        chairs = [] if self._people is None else self._people.movable
        return doors + [MocapBody(chair.name, chair.shapes, chair.pose) for chair in chairs]

    def _write_doors_and_chairs(self, data: Any) -> None:
        self._still = None
        for i, mover in enumerate(self._doors_and_chairs()):
            x, y, yaw = mover.pose
            data.mocap_pos[i] = (x, y, 0.0)
            data.mocap_quat[i] = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))

    def _write_people(self, people: SimulatedPeople, data: Any) -> None:
        walkers = people.walkers
        write_poses(walkers.position, walkers.heading, data.mocap_pos, data.mocap_quat)
