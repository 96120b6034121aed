"""All people of a world: placed on the free floor, walked on by the kernel, each with a script of its own."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from chefbot.buildings.people_spec import PeopleSpec, people_of_each_kind
from chefbot.buildings.world_file import Route
from chefbot.maths.se2 import SE2
from chefbot.sim.people.casting import cast, leaders_of
from chefbot.sim.people.chairs import CHAIR_NAME, CHAIR_RADIUS, ChairTask, choose_chairs
from chefbot.sim.people.floor import DIGITS, Bounds, PeopleFloor, Point, solid_boxes
from chefbot.sim.people.motion import step
from chefbot.sim.people.placing import place_people
from chefbot.sim.people.requests import PeopleRequests
from chefbot.sim.people.spots import DIRECTIONS, DoorwaySpot, HidingPlace, door_sides, doorways, hiding_places
from chefbot.sim.people.walkers import WALK, Floats, Surroundings, walkers_at
from chefbot.sim.world.doors import MovingDoor
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.shapes import OccupiedCircle, SimulatedShape

DECISION_UPDATES = 10
"""Updates between two decisions of a person, who decide in turn: 0.4 s at 25 Hz."""
DESTINATIONS, ROUTE_ENDS, SPOTS, CHAIRS, DOORS = 16, 20, 10, 20, 10
"""Most destinations anywhere and on routes, doorways or corners, chairs and doors that people go to."""
CHAIRS_PER_PERSON = 3
SETTLING_UPDATES = 10
"""Updates for which doors and chairs rest before paths lead round them."""
MOVING_SPEED = 0.05
"""Speed from which people take the robot as moving, m/s."""


class RobotCircle(NamedTuple):
    """The robot as people see it: position, unit vector to its front, radius of the footprint; m."""

    x: float
    y: float
    ux: float
    uy: float
    radius: float

    @staticmethod
    def of(pose: SE2, radius: float) -> RobotCircle:
        """Return a robot of this radius (m) at a pose."""
        return RobotCircle(pose.x, pose.y, math.cos(pose.yaw), math.sin(pose.yaw), radius)


class Habitat(NamedTuple):
    """A world as people see it.

    solids: all that never moves. bounds: (x0, y0, x1, y1). doors: those that they open, close and keep off. routes:
    those of the world file.
    """

    solids: Sequence[SimulatedShape]
    bounds: Bounds
    doors: Sequence[MovingDoor] = ()
    routes: Sequence[Route] = ()


class SimulatedPeople:
    """People who walk by social forces; equal arguments and calls give bit-identical walks on every processor.

    `movable` are the chairs that these people use; they are no longer among the solids of the world. Raises
    UserError if there is no room for all.
    """

    def __init__(self, spec: PeopleSpec, habitat: Habitat, robot: RobotCircle, rng: Generator) -> None:
        self.spec, self.now, self._updates, self.directions = spec, 0.0, 0, DIRECTIONS
        self._robot, self._trail = robot, deque([(0.0, robot)])
        self._last_seen: dict[int, Point] = {}
        *rngs, own_rng = rng.spawn(spec.count + 1)
        self._doors = tuple(habitat.doors)
        self._prepare_floor(habitat, own_rng)
        occupied = [(robot.x, robot.y, robot.radius), *self._chair_circles()]
        if len(self.floor.cells):  # all of the floor, whatever doors and chairs obstruct
            self.floor.obstruct(self._boxes_of_movers())
        positions = place_people(self.floor, occupied, leaders_of(spec), rngs)
        self.walkers = walkers_at(positions, DIRECTIONS[own_rng.integers(len(DIRECTIONS), size=spec.count)])
        self.walkers.shy[:] = spec.avoid_robot
        self._prepare_destinations(habitat, own_rng)
        self._robot_row, self._seen_row = np.zeros(3), np.zeros(4)
        self._state: tuple[float, ...] | None = None
        self._settled: tuple[float, ...] | None = None
        self._state_since = 0
        self._look_at_movers()
        self._persons = cast(self, rngs)
        self._requests = PeopleRequests(self, self._doors, self.floor.add_destination)

    def _prepare_floor(self, habitat: Habitat, rng: Generator) -> None:
        """Build the floor and choose the chairs that people use."""
        fixed = [s for s in habitat.solids if not CHAIR_NAME.search(s.name.split("/")[0])]
        self.floor = PeopleFloor(fixed, habitat.bounds, (self._robot.x, self._robot.y))
        count = min(CHAIRS, CHAIRS_PER_PERSON * people_of_each_kind(self.spec)["pull_chairs"])
        self.movable = choose_chairs(habitat.solids, self.floor, rng, count)

    def _prepare_destinations(self, habitat: Habitat, rng: Generator) -> None:
        """Draw destinations, and find the spots that the kinds need; each comes with its number."""
        floor, numbers = self.floor, people_of_each_kind(self.spec)
        points = [(*point, route.speed) for route in habitat.routes for point in route.points]
        chosen = rng.permutation(len(points))[:ROUTE_ENDS].tolist()
        self.route_ends = [(floor.add_destination(*points[k][:2]), points[k][2]) for k in chosen]
        drawn = [floor.draw_point(rng) for _ in range(DESTINATIONS)]
        self.anywhere = [(floor.add_destination(*point), math.inf) for point in drawn]
        self.doorways: list[tuple[DoorwaySpot, int]] = []
        self.hiding_places: list[tuple[HidingPlace, int]] = []
        self.door_sides: list[tuple[MovingDoor, int]] = []
        if numbers["stand_and_talk"]:
            self.doorways = [(s, floor.add_destination(s.x, s.y)) for s in doorways(floor, rng, SPOTS)]
        if numbers["step_out"]:
            self.hiding_places = [
                (s, floor.add_destination(s.x, s.y)) for s in hiding_places(floor, rng, SPOTS)
            ]
        if numbers["doors"]:
            sides = door_sides(floor, self._doors)[:DOORS]
            self.door_sides = [(door, floor.add_destination(x, y)) for door, x, y in sides]
        self.chairs = [ChairTask(chair, floor) for chair in self.movable]

    # -- the walk

    def advance(self, duration: float, robot: RobotCircle) -> bool:
        """Let all people decide and walk for `duration` s; return whether a chair moved."""
        self._see(robot)
        others = [(robot.x, robot.y, robot.radius), *self.circles()] if self._chair_moves() else []
        moved = [chair.advance(duration, others) for chair in self.movable]
        self._look_at_movers()
        for person in self._persons[self._updates % DECISION_UPDATES :: DECISION_UPDATES]:
            person.decide()
        step(self.walkers, self._surroundings, duration, self._updates)
        self._updates += 1
        self.now += duration
        return any(moved)

    def request(self, text: str) -> None:
        """Let people do 'meet DOOR NUMBER', 'block' or 'leave'. Raises UserError if they cannot."""
        self._requests.process(text, self._persons)

    def circles(self) -> list[OccupiedCircle]:
        """Return the floor areas that the people occupy."""
        return [(x, y, PERSON_RADIUS) for x, y in self.walkers.position.tolist()]

    def add_solid(self, solid: SimulatedShape) -> None:
        """Let people see a new solid that stays where it is."""
        self.floor.add([solid])
        self._settled = None

    # -- what scripts ask for

    @property
    def robot_seen(self) -> Point:
        """Position at which people see the robot, which is that of the reaction time before."""
        return self._trail[0][1][:2]

    @property
    def robot_radius(self) -> float:
        """Radius of the robot's footprint, m."""
        return self._robot.radius

    @property
    def robot_moves(self) -> bool:
        """Whether people see the robot moving."""
        return math.hypot(*self._robot_velocity()) > MOVING_SPEED

    def ahead_of_robot(self, distance: float) -> Point:
        """Return the point at a distance in front of the robot as people see it."""
        _, seen = self._trail[0]
        return seen.x + distance * seen.ux, seen.y + distance * seen.uy

    def robot_distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the robot as people see it."""
        return math.dist((x, y), self.robot_seen)

    def sees_robot(self, number: int) -> bool:
        """Return whether a person sees the robot: near enough, and nothing between them."""
        x, y = self.walkers.position[number].tolist()
        near = self.robot_distance(x, y) <= self.spec.reaction_distance
        if near and self.floor.in_sight(x, y, *self.robot_seen):
            self._last_seen[number] = self.robot_seen
            return True
        return False

    def last_seen_by(self, number: int) -> Point:
        """Return where a person saw the robot last."""
        return self._last_seen[number]

    def room_at(self, x: float, y: float, number: int) -> float:
        """Return the distance from a point to the nearest of the robot and all people but `number`, m."""
        gaps = self.walkers.position - (x, y)
        distances = np.sqrt(gaps[:, 0] ** 2 + gaps[:, 1] ** 2)
        distances[number] = math.inf
        return min(float(distances.min()), math.dist((x, y), self._robot[:2]) - self._robot.radius)

    # -- what people see

    def _see(self, robot: RobotCircle) -> None:
        """Take the robot's pose; people see that of the reaction time before."""
        self._robot = robot
        self._trail.append((self.now, robot))
        while len(self._trail) > 2 and self._trail[1][0] <= self.now - self.spec.reaction_time + 1e-9:
            self._trail.popleft()
        self._robot_row[:] = robot.x, robot.y, robot.radius
        self._seen_row[:2], self._seen_row[2:] = self.robot_seen, self._robot_velocity()

    def _robot_velocity(self) -> Point:
        """Return the velocity of the robot as people see it."""
        (t0, a), (t1, b) = self._trail[0], self._trail[1] if len(self._trail) > 1 else self._trail[0]
        span = max(t1 - t0, 1e-3)
        return (b.x - a.x) / span, (b.y - a.y) / span

    def _chair_moves(self) -> bool:
        return any(chair.out != chair.target for chair in self.movable)

    def _chair_circles(self) -> list[OccupiedCircle]:
        return [(chair.pose.x, chair.pose.y, CHAIR_RADIUS) for chair in self.movable]

    def _look_at_movers(self) -> None:
        """Take the positions of doors and chairs; paths lead round them as soon as they rest."""
        state = (*(door.open for door in self._doors), *(chair.out for chair in self.movable))
        if state != self._state:
            self._state, self._state_since = state, self._updates
            self._surroundings = self._look_around()
        if state != self._settled and self._updates - self._state_since >= SETTLING_UPDATES:
            self._settled = state
            self.floor.obstruct(self._boxes_of_movers())
            walking = self.walkers.mode == WALK
            for number in np.unique(self.walkers.destination[walking]).tolist():
                self.floor.path_length(number, 0.0, 0.0)

    def _look_around(self) -> Surroundings:
        floor = self.floor
        leaves, discs = self._leaf_ends(), np.array(self._chair_circles()).reshape(-1, 3)
        return Surroundings(
            floor.distance,
            floor.frame,
            floor.path_costs,
            floor.path_frame,
            np.round(leaves, DIGITS),
            np.round(discs, DIGITS),
            self._robot_row,
            self._seen_row,
            self.spec.reaction_distance,
        )

    def _leaf_ends(self) -> Floats:
        """Return the ends of all door leaves (m, 4)."""
        poses = [(door.pose, door.pose @ SE2(door.door.width, 0.0, 0.0)) for door in self._doors]
        return np.array([(a.x, a.y, b.x, b.y) for a, b in poses]).reshape(-1, 4)

    def _boxes_of_movers(self) -> Floats:
        """Return leaves and chairs as boxes (n, 7) for the floor."""
        shapes = [door.shape for door in self._doors]
        boxes = solid_boxes(shapes)
        discs = [(x, y, 0.0, 0.0, 1.0, 0.0, radius) for x, y, radius in self._chair_circles()]
        return np.concatenate([boxes, np.round(np.array(discs).reshape(-1, 7), DIGITS)])
