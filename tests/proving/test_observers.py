"""Observers of a run: clearance and near misses, the hash of the messages, wrong claims and odometry drift."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.grid import FREE, OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Collision, LocalizationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import Bool, String
from chefbot.proving.observers import (
    FILE_TOPICS,
    NEAR_MISS,
    MessageHash,
    OdometryDrift,
    SafetyObserver,
    WrongClaims,
)
from chefbot.runtime.loop import Publication

SECOND = 1_000_000_000
RADIUS = 0.2


def publication(topic: str, message: Message, seconds: float = 0.0) -> Publication:
    return Publication(topic, message, "somebody", True, round(seconds * SECOND), False)


def odometry(pose: SE2) -> Odometry:
    return Odometry(pose=PoseWithCovariance(pose=Pose.of(pose)))


# Safety


def hall(*occupied: tuple[int, int]) -> Grid:
    """Return 4 x 4 m of free floor from (0, 0), with the occupied cells (row, column) of 5 cm."""
    cells = np.full((80, 80), FREE, np.int8)
    for row, column in occupied:
        cells[row, column] = OCCUPIED
    return Grid(cells, 0.05, 0.0, 0.0)


class Truth:
    """A simulation whose robot is where the test puts it."""

    def __init__(self) -> None:
        self.pose, self.v, self.people = SE2(0.0, 0.0, 0.0), 0.3, list[SE2]()

    def truth(self) -> Any:
        return SimpleNamespace(pose=self.pose, v=self.v)


def safety(grid: Grid) -> tuple[SafetyObserver, Truth]:
    simulation: Any = Truth()
    observer = SafetyObserver(grid, RADIUS)
    observer.simulation = simulation
    return observer, simulation


def test_without_an_obstacle_nothing_is_near() -> None:
    observer, _ = safety(hall())
    assert observer.clearance(SE2(2.0, 2.0, 0.0)) == math.inf
    assert observer.clearance(SE2(99.0, 2.0, 0.0)) == math.inf


@given(st.floats(0.0, 3.99), st.floats(0.0, 3.99), st.integers(0, 79), st.integers(0, 79))
def test_clearance_is_that_of_the_nearest_cell(x: float, y: float, row: int, column: int) -> None:
    observer, _ = safety(hall((row, column)))
    distance = math.hypot(x - (column + 0.5) * 0.05, y - (row + 0.5) * 0.05)
    assert observer.clearance(SE2(x, y, 0.0)) == pytest.approx(distance - RADIUS, abs=0.0354)


def test_people_are_obstacles() -> None:
    observer, simulation = safety(hall())
    simulation.people = [SE2(1.0, 0.0, 0.0)]
    assert observer.clearance(SE2(2.0, 0.0, 0.0)) == pytest.approx(1.0 - 0.25 - RADIUS)


def drive(observer: SafetyObserver, simulation: Any, distances: list[float], v: float = 0.3) -> None:
    """Be at the distances of the robot's edge to the cell at (2.025, 2.025), one a tenth of a second."""
    for number, distance in enumerate(distances):
        simulation.pose, simulation.v = SE2(2.025 - RADIUS - distance, 2.025, 0.0), v
        observer(publication("ground_truth", odometry(simulation.pose), number / 10))


def test_a_near_miss_counts_once_until_it_is_over() -> None:
    observer, simulation = safety(hall((40, 40)))
    drive(observer, simulation, [0.5, 0.04, 0.1, 0.04, 0.5, 0.04])
    assert observer.near_misses == 2
    assert [what for _, _, _, what in observer.incidents] == ["near miss", "near miss"]
    assert observer.min_clearance < NEAR_MISS
    assert [time for time, _, _ in observer.path] == [0.0, 0.5]


def test_a_robot_that_stands_misses_nothing() -> None:
    observer, simulation = safety(hall((40, 40)))
    drive(observer, simulation, [0.5, 0.0, 0.5], v=0.0)
    assert (observer.near_misses, observer.min_clearance) == (0, math.inf)


def test_collisions_are_noted_with_their_place() -> None:
    observer, simulation = safety(hall())
    simulation.pose = SE2(1.0, 2.0, 0.0)
    observer(publication("collision", Collision(object_name="wall 3"), 4.0))
    assert observer.incidents == [(4.0, 1.0, 2.0, "collision with wall 3")]


def test_nothing_is_measured_before_the_simulator_has_started() -> None:
    observer = SafetyObserver(hall(), RADIUS)
    observer(publication("ground_truth", odometry(SE2(0.0, 0.0, 0.0))))
    assert (observer.path, observer.incidents) == ([], [])


# Messages

MESSAGES = [
    publication("a", Bool(True)),
    publication("a", Bool(False)),
    publication("b", Bool(True)),
    publication("a", Bool(True), 1e-9),
]


def hash_of(publications: list[Publication]) -> str:
    one = MessageHash()
    for publication in publications:
        one(publication)
    return one.hexdigest()


def test_the_hash_depends_on_topic_time_content_and_order() -> None:
    sequences = [[message] for message in MESSAGES] + [MESSAGES, MESSAGES[::-1], []]
    assert len({hash_of(sequence) for sequence in sequences}) == len(sequences)
    assert hash_of(MESSAGES) == hash_of(list(MESSAGES))


def test_images_and_names_of_files_are_not_in_the_hash() -> None:
    files = [publication(topic, String("/home/somebody")) for topic in FILE_TOPICS]
    others = [publication("camera", Image()), *files]
    assert hash_of([*others, *MESSAGES]) == hash_of(MESSAGES)


# Claims


def claims(error: float) -> WrongClaims:
    track = SimpleNamespace(truth=[SE2(0.0, 0.0, 0.0)], estimate=[SE2(error, 0.0, 0.0)])
    scorer: Any = SimpleNamespace(delivering=track)
    return WrongClaims(scorer)


@pytest.mark.parametrize(
    ("error", "localized", "seconds"), [(1.5, True, 2.0), (1.5, False, 0.0), (0.5, True, 0.0)]
)
def test_time_of_wrong_claims_is_added(error: float, localized: bool, seconds: float) -> None:
    observer = claims(error)
    observer(publication("localization_status", LocalizationStatus(localized=localized)))
    for time in (1.0, 2.0, 3.0):
        observer(publication("ground_truth", odometry(SE2(0.0, 0.0, 0.0)), time))
    assert observer.seconds == pytest.approx(seconds)


def test_without_a_pose_no_claim_is_wrong() -> None:
    observer = claims(5.0)
    observer._scorer.delivering.truth.clear()
    observer(publication("localization_status", LocalizationStatus(localized=True)))
    for time in (1.0, 2.0):
        observer(publication("ground_truth", odometry(SE2(0.0, 0.0, 0.0)), time))
    assert observer.seconds == 0.0


# Drift


def test_drift_is_the_error_by_the_distance_driven() -> None:
    observer, start = OdometryDrift(), SE2(3.0, 1.0, 0.7)
    for number in range(5):
        true, reported = SE2(float(number), 0.0, 0.0), SE2(1.1 * number, 0.0, 0.0)
        observer(publication("ground_truth", odometry(start @ true)))
        observer(publication("odom", odometry(reported)))
    assert observer.drift() == pytest.approx(0.1)


def test_a_robot_that_hardly_drove_has_no_drift() -> None:
    observer = OdometryDrift()
    assert math.isnan(observer.drift())
    for x in (0.0, 0.9):
        observer(publication("ground_truth", odometry(SE2(x, 0.0, 0.0))))
        observer(publication("odom", odometry(SE2(x, 0.0, 0.0))))
    assert math.isnan(observer.drift())
