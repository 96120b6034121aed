"""A built robot starts where it was when it was last localized on the same map, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.nodes import NodeRunner

from chefbot.devices.state_files import read_state, store_state
from chefbot.devices.stored_pose import PoseFile, map_identity
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header

KIND = "chefbot.devices.stored_pose:StoredPoseDevice"
HERE = SE2(2.0, -1.0, 0.5)
HOUSE = Grid(np.zeros((20, 30), np.int8), 0.05, -1.0, -2.0)


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path))
    return tmp_path


class Robot:
    """One run of the robot's programs on a map."""

    def __init__(self, grid: Grid = HOUSE, **params: object) -> None:
        self.runner = NodeRunner({"stored_pose": KIND}, {}, {"stored_pose": params})
        self.publish("map", OccupancyGrid.of(Header.of(0, "map"), grid))

    def publish(self, topic: str, message: object) -> None:
        self.runner.loop.publish(topic, message, "test")  # type: ignore[arg-type]
        self.runner.run(0.05)

    def localize(self, pose: SE2, *, localized: bool = True) -> None:
        covariance = PoseWithCovariance(Pose.of(pose), covariance_36(np.diag([0.01, 0.01, 0.01])))
        self.publish("amcl_pose", PoseWithCovarianceStamped(Header.of(0, "map"), covariance))
        self.publish("localization_status", LocalizationStatus(localized=localized))

    def end(self) -> None:
        self.runner.system.stop()

    @property
    def initial_poses(self) -> list[SE2]:
        return [one.pose.pose.se2 for one in self.runner.messages("initialpose")]


def was_at(*poses: SE2, localized: bool = True) -> None:
    robot = Robot()
    for pose in poses:
        robot.localize(pose, localized=localized)
    robot.end()


def test_the_last_pose_outlives_a_restart() -> None:
    was_at(SE2(0.3, 0.0, 0.0), HERE)
    (pose,) = Robot().initial_poses
    assert pose == pytest.approx(HERE)


def test_without_a_pose_localization_is_global_or_at_the_origin() -> None:
    assert Robot().initial_poses == []
    assert Robot(assume_origin=True).initial_poses == [SE2(0.0, 0.0, 0.0)]


def test_a_given_pose_comes_before_the_stored_one() -> None:
    was_at(HERE)
    assert Robot(x=1.0, assume_origin=True).initial_poses == [SE2(1.0, 0.0, 0.0)]


def test_a_lost_robot_stores_no_pose() -> None:
    was_at(HERE, localized=False)
    assert Robot().initial_poses == []


@pytest.mark.parametrize(
    "other",
    [
        Grid(np.full((20, 30), 100, np.int8), 0.05, -1.0, -2.0),
        Grid(np.zeros((30, 20), np.int8), 0.05, -1.0, -2.0),
        Grid(np.zeros((20, 30), np.int8), 0.1, -1.0, -2.0),
        Grid(np.zeros((20, 30), np.int8), 0.05, -1.0, 0.0),
    ],
    ids=["cells", "size", "resolution", "origin"],
)
def test_a_pose_counts_on_its_own_map_only(other: Grid) -> None:
    was_at(HERE)
    assert Robot(other).initial_poses == []


def test_poses_are_stored_on_the_map_that_replaced_another() -> None:
    edited = Grid(np.full((20, 30), 100, np.int8), 0.05, -1.0, -2.0)
    robot = Robot()
    robot.localize(HERE)
    robot.publish("map", OccupancyGrid.of(Header.of(0, "map"), edited))
    robot.localize(HERE)
    robot.end()
    assert len(robot.initial_poses) == 0
    assert Robot(edited).initial_poses == [pytest.approx(HERE)]


def test_a_standing_robot_writes_once(state: Path) -> None:
    robot = Robot()
    robot.localize(HERE)
    robot.end()
    (path,) = state.glob("*.pose.json")
    before = path.stat().st_mtime_ns
    robot = Robot()
    robot.localize(SE2(HERE.x + 0.1, HERE.y, HERE.yaw + 0.1))
    robot.end()
    assert path.stat().st_mtime_ns == before


@pytest.mark.parametrize(
    "content", [b"", b"{", b"null", b'{"map": "x", "x": 0, "y": 0, "yaw": 0}', b" " * 20_000]
)
def test_a_damaged_file_is_one_sentence(state: Path, content: bytes) -> None:
    was_at(HERE)
    (path,) = state.glob("*.pose.json")
    path.write_bytes(content)
    robot = Robot()
    assert robot.initial_poses == []
    (notice,) = robot.runner.messages("stored_pose/notice")
    assert str(path) in notice.data and "without the last pose" in notice.data
    robot.localize(HERE)
    robot.end()
    assert Robot().initial_poses == [pytest.approx(HERE)]


def test_a_folder_that_cannot_be_written_costs_only_the_pose(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHEFBOT_STATE", str(tmp_path / "file" / "state"))
    robot = Robot()
    robot.localize(HERE)
    robot.end()
    robot.runner.run(0.05)
    assert robot.runner.messages("stored_pose/notice")[0].data.startswith("Warning: the robot's pose")


COORDINATES = st.floats(-1e6, 1e6)


@given(COORDINATES, COORDINATES, st.floats(-3.14, 3.14))
@settings(max_examples=30)
def test_a_pose_is_read_as_it_was_written(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, yaw: float
) -> None:
    path = tmp_path_factory.mktemp("state") / "robot.pose.json"
    stored = PoseFile(map=map_identity(HOUSE), x=x, y=y, yaw=yaw)
    store_state(path, stored)
    assert read_state(path, PoseFile) == stored
