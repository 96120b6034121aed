"""Compares the causes that a run kept with the truth of the simulator: what stood at the place, and when."""

from __future__ import annotations

import math
from collections import Counter, deque
from typing import NamedTuple

import numpy as np

from chefbot.causes.chains import is_mapped
from chefbot.causes.history import CauseHistory
from chefbot.causes.reports import END, RANGER
from chefbot.causes.sentences import NOT_ON_MAP, ON_MAP, PERSON
from chefbot.costmap.ranger_marks import MARKING_RANGE
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Cause, NavigationStatus
from chefbot.runtime.loop import Publication
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.furniture import person_shapes
from chefbot.sim.world.shapes import SimulatedShape, clearance

TOLERANCE = 0.12
"""Distance from a place within which something must have stood there, m: half the diagonal of a cell, the noise of
the sensors, and the distance that the robot drives during a measurement."""
PERIOD_NS = 40_000_000
"""Time between two snapshots of the truth, ns."""
KEPT_SNAPSHOTS = 2000
"""Snapshots that are kept: more than the time for which a mark lasts without being confirmed."""
STANDSTILL_SPEED = 0.01
"""Speed below which the robot stands, m/s; turning, rad/s, counts as moving from ten times this on."""
STANDING_TIME = 1.0
"""Time from which standing needs a reason, s."""
REASON_LAG_NS = 1_000_000_000
"""Time before and after standing within which its reason may begin or end, ns."""


class _Snapshot(NamedTuple):
    time_ns: int
    people: list[SE2]
    movable: list[SimulatedShape]


class JudgedCause(NamedTuple):
    """A cause with its place in the world (m), what stood there in truth, and whether the kept reason agrees.

    guess_agrees: whether a guess would: the same distance in any direction, an obstacle drawn from those of the run.
    """

    cause: Cause
    x: float
    y: float
    truth: str
    agrees: bool
    guess_agrees: bool
    pose_error: float
    """Distance between the robot's estimated and its true position, m."""


class TrueCauses:
    """Observer of a run whose map frame is that of the world; judges each place that a check found.

    A place of the ultrasonic ranger may be anywhere across its cone. heights: lowest and highest point of the robot,
    m; what is outside them cannot be in its way. true_map: the map that the robot drives on.
    """

    def __init__(
        self, simulation: Simulation, heights: tuple[float, float], true_map: Grid, seed: int
    ) -> None:
        self._simulation, self._heights, self._map = simulation, heights, true_map
        self._static = {id(solid) for solid in simulation.world.static}
        solids = simulation.solids()
        self._fixed = [solid for solid in solids if id(solid) in self._static and _overlaps(solid, heights)]
        self._snapshots: deque[_Snapshot] = deque(maxlen=KEPT_SNAPSHOTS)
        ranger = simulation.robot.sensors.ultrasonic
        self._cone = 0.0 if ranger is None else MARKING_RANGE * ranger.field_of_view / 2.0
        self._rng = np.random.default_rng([seed, 0xCA05])
        self._kinds: Counter[str] = Counter()
        self.judged: list[JudgedCause] = []
        self.causes: list[Cause] = []
        """All causes of the run, with their ends."""
        self.standing = StandingTime()

    def __call__(self, publication: Publication) -> None:
        """Keep the truth at its rate, and judge each cause."""
        message = publication.message
        self.standing(publication)
        if publication.topic == "ground_truth":
            self._keep(publication.time_ns)
        elif publication.topic == "causes" and isinstance(message, Cause):
            self.causes.append(message)
            found_here = message.kind != END and message.located and not message.caused_by
            if found_here and message.header.frame_id == "map":
                self._judge(message)

    def _keep(self, time_ns: int) -> None:
        truth = self._simulation.truth()
        self.standing.move(time_ns, truth.v, truth.w)
        if self._snapshots and time_ns - self._snapshots[-1].time_ns < PERIOD_NS:
            return
        movable = [
            solid
            for solid in self._simulation.solids()
            if id(solid) not in self._static and _overlaps(solid, self._heights)
        ]
        self._snapshots.append(_Snapshot(time_ns, self._simulation.people, movable))

    def _judge(self, cause: Cause) -> None:
        if not self._snapshots:
            return
        # relative to the robot, so that the error of its pose does not count
        seen_from, true_pose = cause.robot.se2, self._simulation.truth().pose
        offset = seen_from.between(SE2(cause.point.x, cause.point.y, 0.0))
        place = true_pose @ offset
        marked_ns = cause.marked_at.ns or cause.header.stamp.ns
        then = min(self._snapshots, key=lambda one: abs(one.time_ns - marked_ns))
        tolerance = TOLERANCE + (self._cone if cause.sensor == RANGER else 0.0)
        truth = self._truth_at(place.x, place.y, then, tolerance)
        obstacle = NOT_ON_MAP if cause.obstacle == PERSON else cause.obstacle
        self._kinds[obstacle] += 1
        agrees = obstacle in truth.values()
        guess = self._guess(true_pose, math.hypot(offset.x, offset.y), then, tolerance)
        names = ", ".join(truth) or "nothing"
        error = seen_from.distance(true_pose)
        self.judged.append(JudgedCause(cause, place.x, place.y, names, agrees, guess, error))

    def _guess(self, centre: SE2, distance: float, then: _Snapshot, tolerance: float) -> bool:
        """Return whether a random kind of obstacle stood at a random bearing."""
        bearing = self._rng.uniform(-math.pi, math.pi)
        gx = centre.x + distance * math.cos(bearing)
        gy = centre.y + distance * math.sin(bearing)
        kinds, counts = zip(*sorted(self._kinds.items()), strict=True)
        drawn = str(self._rng.choice(kinds, p=np.array(counts) / sum(counts)))
        return drawn in self._truth_at(gx, gy, then, tolerance).values()

    def _truth_at(self, x: float, y: float, then: _Snapshot, tolerance: float) -> dict[str, str]:
        """Return what stood within a tolerance of a place (m), by name, and whether the map has it."""
        found = {}
        for number, pose in enumerate(then.people):
            shapes = [shape.transformed(pose) for shape in person_shapes(number)]
            if clearance(shapes, x, y, *self._heights) <= tolerance:
                found[f"person_{number}"] = NOT_ON_MAP
        for solid in (*self._fixed, *then.movable):
            if math.hypot(x - solid.x, y - solid.y) > solid.reach + tolerance:
                continue
            if clearance([solid], x, y, *self._heights) <= tolerance:
                found[solid.name] = ON_MAP if is_mapped(self._map, x, y) else NOT_ON_MAP
        return found


class StandingTime:
    """The times at which the robot stood with a goal although it had not arrived, and whether a cause was open."""

    def __init__(self) -> None:
        self._driving = False
        self._since_ns: int | None = None
        self._last_ns = 0
        self.intervals: list[tuple[int, int]] = []
        """Begin and end of each time of standing, ns."""

    def __call__(self, publication: Publication) -> None:
        """Follow whether there is a goal."""
        if isinstance(publication.message, NavigationStatus):
            self._driving = publication.message.state not in ("", "idle")
            if not self._driving:
                self._end(publication.time_ns)

    def move(self, time_ns: int, v: float, w: float) -> None:
        """Take the true velocities (m/s, rad/s) of the robot."""
        stands = abs(v) < STANDSTILL_SPEED and abs(w) < 10.0 * STANDSTILL_SPEED
        if stands and self._driving:
            self._since_ns = self._since_ns or time_ns
        else:
            self._end(time_ns)

    def _end(self, time_ns: int) -> None:
        if self._since_ns is not None and time_ns - self._since_ns >= STANDING_TIME * 1e9:
            self.intervals.append((self._since_ns, time_ns))
        self._since_ns = None

    def explained(self, causes: list[Cause]) -> list[bool]:
        """Return for each time of standing whether a cause of a stop, slow-down or failure was kept for it."""
        spans = [(span.began_ns, span.ended_ns or span.began_ns) for span in CauseHistory(causes).spans]
        return [
            any(b - REASON_LAG_NS <= end and e + REASON_LAG_NS >= begin for b, e in spans)
            for begin, end in self.intervals
        ]


def _overlaps(solid: SimulatedShape, heights: tuple[float, float]) -> bool:
    return solid.bottom < heights[1] and solid.top > heights[0]
