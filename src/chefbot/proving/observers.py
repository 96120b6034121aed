"""Observers of a simulated run: what its scorer does not measure."""

from __future__ import annotations

import hashlib
import math
from typing import Any

import numpy as np

from chefbot.demo.score import Scorer
from chefbot.maths.grid import OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Collision, LocalizationStatus
from chefbot.msgs.nav_msgs import Odometry
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import LAUNCH_TOPIC
from chefbot.runtime.recorder import IMAGES
from chefbot.sim.simulation import Simulation

NEAR_MISS = 0.05
"""Distance to an obstacle below which a moving robot nearly hits it, m."""
NEAR_MISS_END = 0.15
"""Distance at which a near miss is over, m."""
MOVING_SPEED = 0.05
"""Speed from which the robot counts as moving, m/s."""
PERSON_REACH = 0.25
"""Radius of a person, m."""
PERSONAL_SPACE = 0.45
"""Distance from which on people keep from each other unless they are intimate, m (Hall 1966)."""
WRONG_POSE = 1.0
"""Position error from which a robot that claims to be localized is wrong, m."""
PATH_PERIOD_NS = 500_000_000


FILE_TOPICS = (LAUNCH_TOPIC, "map_recorder/folder", "map_recorder/notice")
"""Topics whose messages name files of one machine."""


class MessageHash:
    """Hash of all messages of a run: equal runs have equal hashes.

    Without images, and without what names files of one machine: the launch, and the folder of the recorded drives.
    """

    def __init__(self) -> None:
        self._digest = hashlib.blake2b(digest_size=16)

    def __call__(self, publication: Publication) -> None:
        """Add a publication with its topic and time."""
        if isinstance(publication.message, IMAGES) or publication.topic in FILE_TOPICS:
            return
        self._digest.update(f"{publication.topic} {publication.time_ns}\0".encode())
        self._digest.update(publication.message.to_cdr())

    def hexdigest(self) -> str:
        """Return the hash so far."""
        return self._digest.hexdigest()


class SafetyObserver:
    """Path, collisions and near misses of the robot, in the world frame.

    obstacles: cells that the world's solids cover at the robot's heights.
    """

    def __init__(self, obstacles: Grid, radius: float) -> None:
        self._distance = _distance_to(obstacles)
        self._radius = radius
        self.obstacles = obstacles
        self._in_near_miss = False
        self.simulation: Simulation | None = None
        self.path: list[tuple[float, float, float]] = []
        self.incidents: list[tuple[float, float, float, str]] = []
        self.near_misses = 0
        self.min_clearance = math.inf
        self.seconds_near_people = 0.0
        """Time for which the robot drove towards a person who was nearer than their personal space, s."""
        self._last_ns: int | None = None
        self.contact_speed = 0.0
        """Speed of the fastest contact, m/s."""
        self._speed = 0.0

    def __call__(self, publication: Publication) -> None:
        """Measure with each ground truth; note each collision."""
        if self.simulation is None:
            return
        if publication.topic == "ground_truth":
            self._measure(publication.time_ns)
        elif isinstance(publication.message, Collision):
            self._note(publication.time_ns, f"collision with {publication.message.object_name}")
            # the contact itself has slowed the robot down
            speed = max(self._speed, abs(self.simulation.truth().v))
            self.contact_speed = max(self.contact_speed, speed)

    def _measure(self, time_ns: int) -> None:
        assert self.simulation is not None
        truth = self.simulation.truth()
        if time_ns % PATH_PERIOD_NS == 0:
            self.path.append((round(time_ns / 1e9, 2), round(truth.pose.x, 3), round(truth.pose.y, 3)))
        self._speed, clearance = abs(truth.v), self.clearance(truth.pose)
        if self._last_ns is not None and self._approaches_people(truth.pose, truth.v):
            self.seconds_near_people += (time_ns - self._last_ns) / 1e9
        self._last_ns = time_ns
        if abs(truth.v) > MOVING_SPEED:
            self.min_clearance = min(self.min_clearance, clearance)
        if clearance < NEAR_MISS and abs(truth.v) > MOVING_SPEED and not self._in_near_miss:
            self.near_misses += 1
            self._note(time_ns, "near miss")
            self._in_near_miss = True
        elif clearance > NEAR_MISS_END:
            self._in_near_miss = False

    def _approaches_people(self, pose: SE2, v: float) -> bool:
        """Return whether the robot drives towards a person in whose personal space it is."""
        assert self.simulation is not None
        for person in self.simulation.people:
            distance = pose.distance(person)
            ahead = pose.between(person).x / max(distance, 1e-9)
            if distance - PERSON_REACH - self._radius < PERSONAL_SPACE and v * ahead > MOVING_SPEED:
                return True
        return False

    def clearance(self, pose: SE2) -> float:
        """Return the distance from the robot's edge to the nearest solid or person, m, negative in contact."""
        assert self.simulation is not None
        row, column = self._distance.cell(pose.x, pose.y)
        inside = 0 <= row < self._distance.height and 0 <= column < self._distance.width
        distance = float(self._distance.cells[row, column]) if inside else math.inf
        people = [pose.distance(person) - PERSON_REACH for person in self.simulation.people]
        return min([distance, *people]) - self._radius

    def _note(self, time_ns: int, what: str) -> None:
        x, y = self.simulation.truth().pose[:2] if self.simulation else (math.nan, math.nan)
        self.incidents.append((round(time_ns / 1e9, 2), round(x, 3), round(y, 3), what))


def _distance_to(obstacles: Grid) -> Grid:
    from scipy import ndimage  # takes half a second

    free = obstacles.cells != OCCUPIED
    # The transform of a grid without any obstacle is the distance to its corner
    distances: Any = np.full(free.shape, math.inf) if free.all() else ndimage.distance_transform_edt(free)
    return Grid(
        distances * obstacles.resolution, obstacles.resolution, obstacles.origin_x, obstacles.origin_y
    )


class WrongClaims:
    """Time during which the robot claims to be localized and is elsewhere."""

    def __init__(self, scorer: Scorer) -> None:
        self._scorer = scorer
        self._last_ns: int | None = None
        self._localized = False
        self.seconds = 0.0

    def __call__(self, publication: Publication) -> None:
        """Add the time since the last ground truth, if the claim is wrong now."""
        if isinstance(publication.message, LocalizationStatus):
            self._localized = publication.message.localized
        elif publication.topic == "ground_truth":
            track = self._scorer.delivering
            is_wrong = (
                self._localized and track.truth and track.truth[-1].distance(track.estimate[-1]) > WRONG_POSE
            )
            if is_wrong and self._last_ns is not None:
                self.seconds += (publication.time_ns - self._last_ns) / 1e9
            self._last_ns = publication.time_ns


class OdometryDrift:
    """Position error of the odometry, which starts at the robot's start, by the distance driven."""

    def __init__(self) -> None:
        self._truth: SE2 | None = None
        self._start: SE2 | None = None
        self._length = 0.0
        self.odometry: SE2 | None = None

    def __call__(self, publication: Publication) -> None:
        """Keep the latest poses."""
        message = publication.message
        if not isinstance(message, Odometry):
            return
        pose = message.pose.pose.se2
        if publication.topic == "odom":
            self.odometry = pose
        elif publication.topic == "ground_truth":
            self._start = self._start or pose
            self._length += 0.0 if self._truth is None else self._truth.distance(pose)
            self._truth = pose

    def drift(self) -> float:
        """Return the error at the end over the distance driven, m/m; NaN if it hardly drove."""
        if self._start is None or self._truth is None or self.odometry is None or self._length < 1.0:
            return math.nan
        return self._start.between(self._truth).distance(self.odometry) / self._length
