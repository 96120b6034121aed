"""Mapper and map recorder: map and drive are on the disk while the robot maps, and are continued from there."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np
import pytest
from tests.support.mapping_robot import LASER, MAPPERS, MappingRobot, bundles
from tests.support.pillar_room import ANGLES, ranges_at
from tests.support.waiting import wait_for

from chefbot.devices.maps.kept_map import drives_of, up_to_pose
from chefbot.devices.maps.map_recorder import WRITE_PERIOD
from chefbot.errors import ChefbotError
from chefbot.mapping.map_format import encode_pgm
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ExplorationStatus
from chefbot.msgs.chefbot_msgs.maps import MappedScan, MapTrajectory
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance, PoseWithCovarianceStamped, TransformStamped
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Empty, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.continued_map import ContinuedMap
from chefbot.nodes.scans.drive_messages import DriveMessages
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.node import RESTORED_PREFIX
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.offline import OfflineMapper
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.slam.trajectory_adjustment import adjusted_map
from chefbot.storage.mapped_drives import BUNDLE, load_drives


def rebuilt(bundle: Path) -> bytes:
    drives = load_drives(bundle)
    laser = SE2.of(drives.sessions[0].laser)
    mapper = OfflineMapper(drives.params, laser, drives.sessions[0].start_pose)
    for session in drives.sessions:
        mapper.repeat(session)
    return mapper.slam.map().cells.tobytes()


@pytest.mark.rotated("recorded maps")
@pytest.mark.parametrize("mapper", MAPPERS)
def test_the_bundle_gives_the_live_map_again(tmp_path: Path, mapper: str) -> None:
    robot = MappingRobot(tmp_path, mapper=mapper)
    robot.drive()
    robot.end()
    (bundle,) = bundles(tmp_path)
    live = robot.messages("map")[-1]
    assert isinstance(live, OccupancyGrid)
    assert rebuilt(bundle) == live.grid.cells.tobytes()
    assert bundle.with_name("map.pgm").read_bytes() == encode_pgm(live.grid)


def test_a_map_is_on_the_disk_before_the_end(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    robot.drive()
    robot.run(WRITE_PERIOD)
    wait_for(lambda: robot.run(0.1) or robot.notices())
    assert robot.notices() == [f"The map and its drive are kept in {bundles(tmp_path)[0].parent}."]
    assert robot.messages("map_recorder/folder")[-1].data == str(bundles(tmp_path)[0].parent)
    robot.end()


def written(robot: MappingRobot) -> str:
    """Have the map written at once, and return the folder that the recorder then names."""
    before = len(robot.messages("map_recorder/written"))
    robot.loop.publish("map_recorder/write", Empty(), "page")
    wait_for(lambda: robot.run(0.01) or len(robot.messages("map_recorder/written")) > before)
    return str(robot.messages("map_recorder/written")[-1].folder)


def adjusted_picture(robot: MappingRobot, bundle: Path) -> bytes:
    """Return the picture of the map after the joint adjustment of the newest poses."""
    trajectory = robot.messages("map_trajectory")[-1]
    assert isinstance(trajectory, MapTrajectory)
    poses = [SE2.of(pose) for pose in trajectory.poses.reshape(-1, 3)]
    drives = load_drives(bundle)
    return encode_pgm(adjusted_map(up_to_pose(drives.sessions, len(poses)), poses, drives.params).grid)


@pytest.mark.parametrize("mapper", MAPPERS)
def test_a_map_on_request_has_its_poses_adjusted(tmp_path: Path, mapper: str) -> None:
    robot = MappingRobot(tmp_path, mapper=mapper)
    robot.drive()
    for _ in range(2):
        bundle = Path(written(robot)) / BUNDLE
        assert bundle.with_name("map.pgm").read_bytes() == adjusted_picture(robot, bundle)
    robot.end()


def test_after_an_exploration_the_poses_are_adjusted(tmp_path: Path) -> None:
    """Also of a map that was written before as it was then."""
    robot = MappingRobot(tmp_path)
    robot.drive()
    robot.run(WRITE_PERIOD)
    wait_for(lambda: robot.run(0.1) or robot.notices())
    (bundle,) = bundles(tmp_path)
    picture, adjusted = bundle.with_name("map.pgm"), adjusted_picture(robot, bundle)
    robot.loop.publish("exploration_status", ExplorationStatus(done=False), "explorer")
    robot.run(1.0)
    assert picture.read_bytes() != adjusted
    robot.loop.publish("exploration_status", ExplorationStatus(done=True), "explorer")
    wait_for(lambda: robot.run(0.1) or picture.read_bytes() == adjusted)
    robot.end()
    assert picture.read_bytes() == adjusted


def test_scans_without_a_pose_yet_are_not_part_of_the_map() -> None:
    sessions = [session_of(4), session_of(3)]
    for poses, used in ((7, [4, 3]), (6, [4, 2]), (4, [4]), (1, [1])):
        assert [int(drive.used.sum()) for drive in up_to_pose(sessions, poses)] == used


def test_a_map_is_written_at_once_on_request(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    assert written(robot) == ""  # the robot has not moved yet
    robot.drive()
    folder = written(robot)
    (bundle,) = bundles(tmp_path)
    assert folder == str(bundle.parent)
    robot.drive(0.5)
    short = len(load_drives(bundle).sessions[0].stamps)
    assert written(robot) == folder
    assert len(load_drives(bundle).sessions[0].stamps) > short
    assert written(robot) == folder  # nothing has changed since
    robot.end()


def test_a_reset_begins_another_folder(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    robot.drive()
    robot.loop.publish("reset_map", Empty(), "page")
    robot.drive(0.5)
    robot.end()
    first, second = (load_drives(bundle).sessions for bundle in bundles(tmp_path))
    assert len(first) == len(second) == 1 and len(first[0].stamps) > 1.5 * len(second[0].stamps)


def test_maps_of_one_second_do_not_replace_each_other(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    for _ in range(4):
        robot.drive(0.2)
        robot.loop.publish("reset_map", Empty(), "page")
    robot.end()
    assert len(bundles(tmp_path)) == 4


def test_a_restarted_mapper_adds_another_drive(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    robot.drive()
    last = robot.messages("mapped_scan")[-1]
    assert isinstance(last, MappedScan) and not last.continued and last.number > 100
    start = SE2(0.5, 0.25, 0.1)
    messages = DriveMessages(GmappingParams(), LASER, start, continued=True)
    scan = LaserScan(last.header, -math.pi, math.pi, 0.035, 0.0, 0.1, 0.1, 12.0, ranges_at(LASER))
    for x in (0.0, 0.1, 0.2):
        message = messages.next(scan, SE2(x, 0.0, 0.0), used=x < 0.2)
        robot.loop.publish("mapped_scan", message, "gmapping")
    robot.run(0.1)
    robot.end()
    (bundle,) = bundles(tmp_path)
    first, second = load_drives(bundle).sessions
    assert first.start_pose == SE2(0.0, 0.0, 0.0) and second.start_pose == start
    assert second.used.tolist() == [True, True, False]


@pytest.mark.rotated("recorded maps")
@pytest.mark.parametrize("mapper", MAPPERS)
def test_a_restarted_process_goes_on_in_the_same_folder(tmp_path: Path, mapper: str) -> None:
    robot = MappingRobot(tmp_path, mapper=mapper)
    robot.drive()
    robot.run(WRITE_PERIOD)
    wait_for(lambda: robot.run(0.1) or robot.notices())
    transforms = TFMessage((TransformStamped.of(0, "map", "odom", robot.map_to_odom()),))
    topics = ("map", "map_recorder/folder")
    before = {topic: robot.messages(topic)[-1] for topic in topics}
    restarted = MappingRobot(tmp_path, mapper=mapper, restored={**before, "tf": transforms})
    restarted.drive(0.5)
    restarted.end()
    (bundle,) = bundles(tmp_path)
    first, second = load_drives(bundle).sessions
    assert len(first.stamps) > 1.5 * len(second.stamps)
    assert restarted.map_to_odom().distance(SE2(0.0, 0.0, 0.0)) < 0.05


def test_a_folder_that_cannot_be_read_after_a_restart_is_left(earlier: Path, tmp_path: Path) -> None:
    kept = tmp_path / "kept" / "map.bundle"
    kept.parent.mkdir()
    kept.write_bytes(b"damaged")
    robot = MappingRobot(tmp_path / "later", str(earlier), mapper_of(earlier))
    robot.system.isolate_faults(lambda _: None)
    robot.loop.publish(
        f"{RESTORED_PREFIX}map_recorder/folder", String(str(kept.parent)), "wire", from_device=True
    )
    pose = PoseWithCovariance(Pose.of(SE2(0.0, 0.0, 0.0)))
    robot.loop.publish("initialpose", PoseWithCovarianceStamped(Header.of(0, "map"), pose), "page")
    robot.drive()
    robot.end()
    assert kept.read_bytes() == b"damaged" and len(bundles(tmp_path / "later")) == 1


@pytest.fixture(params=MAPPERS)
def earlier(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    robot = MappingRobot(tmp_path / "earlier", mapper=request.param)
    robot.drive()
    robot.end()
    return bundles(tmp_path / "earlier")[0]


def mapper_of(bundle: Path) -> str:
    return "graph_slam" if isinstance(load_drives(bundle).params, GraphSlamParams) else "gmapping"


@pytest.mark.rotated("recorded maps")
def test_a_map_is_continued_from_a_given_pose(earlier: Path, tmp_path: Path) -> None:
    before = hashlib.sha256(earlier.read_bytes()).hexdigest()
    robot = MappingRobot(tmp_path / "later", str(earlier.parent), mapper_of(earlier))
    robot.began = SE2(2.0, 0.5, 1.0)
    robot.scan(SE2(0.0, 0.0, 0.0))
    assert not robot.messages("mapped_scan"), "the robot is not found yet"
    assert "looks for the robot" in robot.messages("scan/notice")[-1].data
    pose = PoseWithCovarianceStamped(Header.of(0, "map"), PoseWithCovariance(Pose.of(robot.began)))
    robot.loop.publish("initialpose", pose, "page")
    robot.drive()
    assert "the map is continued" in robot.messages("scan/notice")[-1].data
    found = robot.map_to_odom()
    assert found.distance(robot.began) < 0.05 and abs(found.between(robot.began).yaw) < 0.05
    robot.end()
    (bundle,) = bundles(tmp_path / "later")
    assert len(load_drives(bundle).sessions) == 2
    assert rebuilt(bundle) == robot.messages("map")[-1].grid.cells.tobytes()
    assert hashlib.sha256(earlier.read_bytes()).hexdigest() == before


@pytest.mark.rotated("recorded maps")
def test_the_robot_is_found_on_the_map_while_it_drives(earlier: Path, tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path / "later", str(earlier), mapper_of(earlier))
    robot.began = SE2(1.5, 0.3, 2.0)
    robot.drive(2.0)
    first = robot.messages("mapped_scan")[0]
    true = robot.began @ SE2.of(first.odometry)
    assert SE2.of(first.start).distance(true) < 0.15 and first.continued and first.number == 0
    robot.end()


@pytest.mark.parametrize("size", [0, 1, 100, 3000])
def test_a_damaged_bundle_is_refused_at_the_start(earlier: Path, tmp_path: Path, size: int) -> None:
    damaged = tmp_path / "damaged.bundle"
    damaged.write_bytes(earlier.read_bytes()[:size])
    with pytest.raises(ChefbotError, match=r"damaged\.bundle"):
        MappingRobot(tmp_path / "later", str(damaged))


def test_a_recorder_that_begins_too_late_keeps_nothing(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    message = MappedScan(Header.of(1, "laser"), 7, used=True)
    robot.loop.publish("mapped_scan", message, "gmapping")
    robot.run(WRITE_PERIOD)
    robot.end()
    assert "has missed the beginning of the map" in robot.notices()[-1] and not bundles(tmp_path)


@pytest.mark.parametrize("mapper", ["", "{}", '{"algorithm": "graph", "params": {"resolution": 7}}', "\0"])
def test_a_drive_of_no_mapper_is_refused(tmp_path: Path, mapper: str) -> None:
    robot = MappingRobot(tmp_path)
    faults: list[Fault] = []
    robot.system.isolate_faults(faults.append)
    robot.loop.publish("mapped_scan", MappedScan(Header.of(1, "laser"), mapper=mapper), "gmapping")
    robot.run(0.1)
    (fault,) = faults
    assert isinstance(fault.error, ChefbotError) and "mapper.json" in fault.sentence
    robot.end()


def test_a_folder_that_cannot_be_made_is_one_warning(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    robot = MappingRobot(tmp_path / "file")
    robot.drive(0.5)
    for _ in range(2):
        robot.run(WRITE_PERIOD)
        robot.drive(0.5)
    wait_for(lambda: robot.run(0.1) or robot.notices())
    assert len(robot.notices()) == 1 and robot.notices()[0].startswith("Warning: the map cannot be kept: ")
    robot.end()


@pytest.mark.rotated("recorded maps")
def test_another_mount_of_the_laser_is_refused(earlier: Path) -> None:
    continued = ContinuedMap(earlier)
    header = Header.of(1, "laser")
    scan = LaserScan(header, -3.14, 3.14, 0.035, 0.0, 0.1, 0.1, 12.0, ranges_at(LASER))
    with pytest.raises(
        ChefbotError, match=r"No map is made: the laser is mounted at x 0\.10 m, y 0\.00 m, yaw 0\.10 rad"
    ):
        continued.find(LASER @ SE2(0.0, 0.0, 0.1), scan, SE2(0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("frame", "x", "reason"),
    [
        ("base_link", 1.0, "its frame is base_link, not map"),
        ("map", 30.0, "is not on the known part of the map"),
    ],
)
def test_a_pose_that_cannot_be_is_ignored(
    earlier: Path, tmp_path: Path, frame: str, x: float, reason: str
) -> None:
    robot = MappingRobot(tmp_path / "later", str(earlier), mapper_of(earlier))
    faults: list[Fault] = []
    robot.system.isolate_faults(faults.append)
    pose = PoseWithCovariance(Pose.of(SE2(x, 0.0, 0.0)))
    robot.loop.publish("initialpose", PoseWithCovarianceStamped(Header.of(0, frame), pose), "page")
    robot.scan(SE2(0.0, 0.0, 0.0))
    texts = [fault.sentence for fault in faults] + [one.data for one in robot.messages("scan/notice")]
    assert any(reason in text for text in texts) and not robot.messages("mapped_scan")
    robot.end()


@pytest.mark.rotated("recorded maps")
def test_another_building_is_not_continued(earlier: Path, tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path / "later", str(earlier), mapper_of(earlier))
    robot.room = 0.6  # everything is nearer
    faults: list[Fault] = []
    robot.system.isolate_faults(faults.append)
    robot.drive(2.0)
    assert not robot.messages("mapped_scan")
    robot.end()
    assert not bundles(tmp_path / "later")


def test_a_robot_that_does_not_move_keeps_no_map(tmp_path: Path) -> None:
    robot = MappingRobot(tmp_path)
    for _ in range(30):
        robot.scan(SE2(0.0, 0.0, 0.0))
    robot.run(WRITE_PERIOD)
    robot.end()
    assert robot.messages("map") and not bundles(tmp_path)


@pytest.mark.rotated("recorded maps")
@pytest.mark.parametrize("mapper", MAPPERS)
def test_the_error_of_the_live_map_is_published(tmp_path: Path, mapper: str) -> None:
    robot = MappingRobot(tmp_path, mapper=mapper)
    robot.drive(1.3)
    robot.run(WRITE_PERIOD)
    wait_for(lambda: robot.run(0.1) or robot.messages("map_error"))
    errors = robot.messages("map_error")[-1]
    assert isinstance(errors, OccupancyGrid) and errors.header.frame_id == "map"
    known = errors.grid.cells[errors.grid.cells >= 0]
    assert len(known) and np.median(known) <= 10  # cm
    robot.end()


@pytest.mark.parametrize(
    ("poses", "drives"), [(0, 0), (1, 1), (20, 1), (21, 2), (50, 2), (51, 3), (90, 3), (99, 3)]
)
def test_the_latest_drives_fit_a_trajectory(poses: int, drives: int) -> None:
    sessions = [session_of(count) for count in (40, 30, 20)]
    assert drives_of(sessions, poses) == sessions[len(sessions) - drives :]


def session_of(scans: int) -> Session:
    recorded = [
        RecordedScan(0.1 * k, ANGLES, ranges_at(LASER), LASER, SE2(0.0, 0.0, 0.0)) for k in range(scans)
    ]
    return Session.of(recorded, [True] * scans, 10.0, None)
