"""Scoring of a simulated run; the only module that uses the ground truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chefbot.devices.maps.kept_map import KeptMap, MappedDrive
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Collision, DeliveryStatus, LocalizationStatus, NavigationStatus
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.transform_buffer import TransformError
from chefbot.slam.params import GmappingParams
from chefbot.storage.mapped_drives import MapperParams, decode_mapper

ARRIVAL_TOLERANCE = 0.35
"""Maximum distance from the true place at which a guest can reach the food, m."""


@dataclass
class Track:
    """Ground-truth and estimated poses at the same instants."""

    times: list[float] = field(default_factory=list)
    truth: list[SE2] = field(default_factory=list)
    estimate: list[SE2] = field(default_factory=list)

    def errors(self) -> NDArray[np.float64]:
        """Return the position error at each instant, m; shape (n,)."""
        return np.array([a.distance(b) for a, b in zip(self.truth, self.estimate, strict=True)])


class Scorer:
    """Observes all messages of a loop and scores the run: `loop.tap(scorer)`."""

    def __init__(self, system: NodeContainer, places: dict[str, SE2]) -> None:
        self._system = system
        self.places = places
        self.mapping = Track()
        self.delivering = Track()
        self.localized = False
        self.map: OccupancyGrid | None = None
        self.saved_map: Grid | None = None
        self._drives: list[MappedDrive] = []
        self._mapper: MapperParams = GmappingParams()
        self._trajectory = MapTrajectory()
        self.path_length = 0.0
        self.collisions: list[str] = []
        self.recoveries = 0
        self.delivery = DeliveryStatus()
        self.delivered: list[str] = []
        """Places where the robot reported an arrival with food and truly was."""
        self.phase = "mapping"
        self.last_ground_truth = SE2(0.0, 0.0, 0.0)
        self._last_recoveries = 0

    def __call__(self, publication: Publication) -> None:
        """Update the score with one published message."""
        message = publication.message
        if publication.topic == "ground_truth" and isinstance(message, Odometry):
            self._on_ground_truth(message)
        elif publication.topic == "map" and isinstance(message, OccupancyGrid):
            self.map = message
        elif isinstance(message, MappedScan):
            self._on_mapped_scan(message)
        elif isinstance(message, MapTrajectory):
            self._trajectory = message
        elif isinstance(message, Collision):
            self.collisions.append(message.object_name)
        elif isinstance(message, LocalizationStatus):
            self.localized = message.localized
        elif isinstance(message, NavigationStatus):
            self.recoveries += max(0, message.recoveries - self._last_recoveries)
            self._last_recoveries = message.recoveries
        elif isinstance(message, DeliveryStatus):
            self._on_delivery_status(message)

    def _on_mapped_scan(self, message: MappedScan) -> None:
        if message.number == 0:
            # A mapper that has restarted continues its map with another drive
            self._drives = [*(self._drives if message.continued else ()), MappedDrive(message)]
            self._mapper = decode_mapper(message.mapper.encode())
        self._drives[-1].add(message)

    def final_map(self) -> Grid | None:
        """Return the latest map, with its poses adjusted jointly if it was mapped here; None without a map."""
        if self.map is None:
            return None
        if not self._drives:
            return self.map.grid
        kept = KeptMap(self.map.grid, self._mapper, [], self._drives, self._trajectory)
        return kept.adjusted(kept.sessions()).grid

    def _on_ground_truth(self, truth: Odometry) -> None:
        """Compare the latest estimate with the ground truth of the same instant."""
        pose = truth.pose.pose.se2
        self.path_length += self.last_ground_truth.distance(pose)
        self.last_ground_truth = pose
        if self.phase == "localizing":
            return  # it does not report to be localized yet
        stamp = truth.header.stamp.ns
        track = self.mapping if self.phase == "mapping" else self.delivering
        self._system.transforms.on_available(
            "odom", "base_link", stamp, lambda odom: self._add_sample(track, stamp, truth.pose.pose.se2, odom)
        )

    def _add_sample(self, track: Track, stamp: int, truth: SE2, odom: SE2) -> None:
        try:
            estimate = self._system.transforms.lookup("map", "odom") @ odom
        except TransformError:
            return  # no map yet
        track.times.append(stamp / 1e9)
        track.truth.append(truth)
        track.estimate.append(estimate)

    def _on_delivery_status(self, status: DeliveryStatus) -> None:
        self.delivery = status
        place = self.places.get(status.place)
        if (
            status.state == "waiting"
            and place
            and self.last_ground_truth.distance(place) <= ARRIVAL_TOLERANCE
        ):
            self.delivered.append(status.place)

    def at_home(self) -> bool:
        """Return whether the robot truly is at home."""
        return self.last_ground_truth.distance(self.places["home"]) <= ARRIVAL_TOLERANCE


def error_statistics(errors: NDArray[np.float64]) -> dict[str, float | None]:
    """Return the median, 95th percentile and maximum of the errors; None without any value."""
    if len(errors) == 0:
        return {"median": None, "p95": None, "max": None}
    return {
        "median": round(float(np.median(errors)), 4),
        "p95": round(float(np.percentile(errors, 95)), 4),
        "max": round(float(errors.max()), 4),
    }


def simulated_click(truth: SE2, rng: np.random.Generator) -> SE2:
    """Return a pose as an operator would click it: 0.5 m and 20 degrees off, in a random direction."""
    bearing = rng.uniform(-math.pi, math.pi)
    turn = math.copysign(math.radians(20.0), rng.uniform(-1.0, 1.0))
    return SE2(truth.x + 0.5 * math.cos(bearing), truth.y + 0.5 * math.sin(bearing), truth.yaw + turn)
