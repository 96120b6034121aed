"""Drives in bags of every format: scans with the odometry's pose, and the laser's mount by transforms."""

from __future__ import annotations

import builtins
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.drive_bags import FORMATS, LEVEL, UPSIDE_DOWN, DriveBag, straight_drive

from chefbot.cli.map.bag_drive import ONLY_TOPICS, BagChoice, read_drive, read_log
from chefbot.cli.map.laser_mount import laser_mount, turned_upright
from chefbot.errors import ChefbotError
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.ros2.bag.rosbags_reader import needs_rosbags

START = 10**12
LASER = (0.2, -0.1, 0.3)
RANGES = np.array([0.05, 1.0, np.nan, 3.0, np.inf, 5.0, 11.0])
"""Too near, measured, no reading, measured, no return, measured, too far."""


def bag_of(folder: Path, kind: str = "mcap", turn: tuple[float, float, float, float] = LEVEL) -> DriveBag:
    """A bag with the odometry of a drive, a laser on it, and a scan every half second."""
    bag = DriveBag(folder, kind)
    bag.transform(START, "base_link", "mast", (0.0, -0.1, 0.2), LEVEL)
    bag.transform(START, "mast", "laser", (0.2, 0.0, 0.1), turn)
    for stamp, pose in straight_drive():
        bag.odometry(stamp, pose)
    for k in range(4):
        bag.scan(START + 500_000_000 * k + 7_000_000, (-1.5, 1.5), RANGES)
    return bag


@pytest.mark.parametrize("kind", FORMATS)
def test_every_format_gives_the_same_drive(kind: str, tmp_path: Path) -> None:
    drive = read_log(bag_of(tmp_path, kind).close(), ONLY_TOPICS)
    assert drive.notes == [] and len(drive.scans) == 4
    scan = drive.scans[1]
    assert scan.stamp == pytest.approx(START / 1e9 + 0.507)
    assert tuple(scan.odom) == pytest.approx((0.507, 0.1, 0.1014), abs=1e-6)  # between two of its messages
    assert tuple(scan.odom.between(scan.laser)) == pytest.approx((0.2, -0.1, 0.0), abs=1e-9)
    assert scan.ranges[[1, 3, 5]] == pytest.approx([1.0, 3.0, 5.0])
    assert (scan.ranges[[0, 2]] == 0.0).all() and (scan.ranges[[4, 6]] > 1000.0).all()


def test_a_laser_upside_down_sees_the_same_walls(tmp_path: Path) -> None:
    level, turned = (
        read_drive(bag_of(tmp_path / name, turn=turn).close(), ONLY_TOPICS).scans[2]
        for name, turn in (("level", LEVEL), ("turned", UPSIDE_DOWN))
        if (tmp_path / name).mkdir() is None
    )
    assert turned.angles == pytest.approx(level.angles) and (turned.ranges == level.ranges[::-1]).all()


def test_a_sweep_is_without_skew(tmp_path: Path) -> None:
    """The beam straight ahead is measured after 0.1 s, when the robot is 0.1 m nearer to the wall."""
    bag = bag_of(tmp_path)
    bag.scan(START + 1_000_000_000, (-1.5, 1.5), np.full(101, 4.0), topic="/swept", sweep=0.2)
    scan = read_drive(bag.close(), BagChoice(scan_topic="/swept")).scans[0]
    ahead = scan.ranges[np.argmin(np.abs(scan.angles - 0.02))]
    assert ahead == pytest.approx(4.1, abs=0.01)


def test_the_usual_topics_are_taken_and_others_by_name(tmp_path: Path) -> None:
    bag = bag_of(tmp_path)
    bag.scan(START + 5_000_000, (-1.0, 1.0), np.ones(5), topic="/depth_scan")
    bag.odometry(START, SE2(9.0, 9.0, 0.0), topic="/ground_truth")
    path = bag.close()
    assert len(read_drive(path, ONLY_TOPICS).scans[0].ranges) == 7
    other = read_drive(path, BagChoice("depth_scan", "/ground_truth", SE2(1.0, 2.0, 0.5))).scans[0]
    assert len(other.ranges) == 5 and tuple(other.odom) == pytest.approx((9.0, 9.0, 0.0))
    assert tuple(other.odom.between(other.laser)) == pytest.approx((1.0, 2.0, 0.5))


def test_odometry_by_transforms_is_enough(tmp_path: Path) -> None:
    bag = DriveBag(tmp_path, "mcap")
    for stamp, pose in straight_drive():
        half = pose.yaw / 2
        bag.transform(
            stamp, "odom", "base", (pose.x, pose.y, 0.0), (0.0, 0.0, math.sin(half), math.cos(half)), "/tf"
        )
        bag.transform(stamp, "base", "laser", LASER, LEVEL, "/tf")
    bag.scan(START + 990_000_000, (-1.5, 1.5), RANGES)
    (scan,) = read_drive(bag.close(), ONLY_TOPICS).scans
    assert tuple(scan.odom) == pytest.approx((0.99, 0.1, 0.198), abs=1e-6)
    assert tuple(scan.odom.between(scan.laser)) == pytest.approx((0.2, -0.1, 0.0), abs=1e-9)


def test_scans_without_odometry_are_left_out_with_a_note(tmp_path: Path) -> None:
    bag = bag_of(tmp_path)
    bag.scan(START + 9_000_000_000, (-1.5, 1.5), RANGES)
    drive = read_drive(bag.close(), ONLY_TOPICS)
    assert len(drive.scans) == 4 and drive.notes == ["1 of 5 scans without odometry are left out."]


def test_scans_in_a_gap_of_the_odometry_are_left_out(tmp_path: Path) -> None:
    bag = DriveBag(tmp_path, "mcap")
    for second in (0, 1, 2, 10, 11):
        bag.odometry(START + 10**9 * second, SE2(float(second), 0.0, 0.0))
    for tenths in (4, 15, 23, 60, 97):
        bag.scan(START + 10**8 * tenths, (-1.0, 1.0), np.ones(5))
    drive = read_drive(bag.close(), BagChoice(laser=SE2(0.0, 0.0, 0.0)))
    assert [round(scan.odom.x, 6) for scan in drive.scans] == [0.4, 1.5, 2.3, 9.7]
    assert drive.notes == ["1 of 5 scans without odometry are left out."]


def test_messages_without_beams_or_finite_poses_are_left_out(tmp_path: Path) -> None:
    bag = bag_of(tmp_path)
    bag.scan(START + 300_000_000, (-1.0, 1.0), np.ones(1))
    bag.odometry(START + 301_000_000, SE2(math.nan, 0.0, 0.0))
    drive = read_drive(bag.close(), ONLY_TOPICS)
    assert len(drive.scans) == 4 and all(math.isfinite(scan.odom.x) for scan in drive.scans)
    assert "1 of 5 scans without beams are left out." in drive.notes and len(drive.notes) == 2


def test_names_of_frames_may_begin_with_a_slash() -> None:
    (edge,) = [
        TransformStamped(
            Header.of(0, "/base_link"), "/laser", Transform(Vector3(0.3, 0.0, 0.1), Quaternion())
        )
    ]
    assert (
        laser_mount([edge], "base_link", "laser") == laser_mount([edge], "/base_link", "/laser") is not None
    )


def test_a_bag_that_cannot_be_used_is_reported_in_one_sentence(tmp_path: Path) -> None:
    def refused(name: str, reason: str, choice: BagChoice = ONLY_TOPICS, **parts: Any) -> None:
        (tmp_path / name).mkdir()
        bag = DriveBag(tmp_path / name, "mcap")
        bag.odometry(START, SE2(0.0, 0.0, 0.0)) if parts.get("odometry", True) else None
        for topic in parts.get("scans", ("/scan",)):
            for number, second in enumerate(parts.get("times", (parts.get("late", 0),))):
                angles, ranges = parts.get("angles", (-1.0, 1.0)), parts.get("ranges", np.ones(5))
                recorded = START + 10**10 * number
                bag.scan(START + 10**9 * second, angles, ranges, topic=topic, recorded_ns=recorded)
        if "turn" in parts:
            bag.transform(START, "base_link", "laser", LASER, parts["turn"])
        with pytest.raises(ChefbotError, match=reason):
            read_drive(bag.close(), choice)

    refused("empty", "no laser scans", scans=())
    refused(
        "several", "more than one topic of sensor_msgs/msg/LaserScan: choose --scan-topic", scans=("/a", "/b")
    )
    refused("unknown", "no /c of .*choose --scan-topic of /scan", BagChoice("/c"))
    refused("unmounted", "no transform from base_link to laser: give the laser's pose by --laser")
    refused("tilted", "tilted by 45 degrees", turn=(0.0, math.sin(math.pi / 8), 0.0, math.cos(math.pi / 8)))
    refused("no_odometry", "neither odometry", odometry=False)
    refused("nan", "no scan on /scan has a range", turn=LEVEL, ranges=np.full(5, np.nan))
    refused("one_angle", "angle_increment 0, which no laser has", turn=LEVEL, angles=(1.0, 1.0))
    refused("turns", "are more than a turn", turn=LEVEL, angles=(-4.0, 4.0), ranges=np.ones(50))
    refused("back", "message 3 on /scan the time goes back by 5.0 s", turn=LEVEL, times=(0, 5, 0))
    refused("late", "no scan was measured while there was odometry", turn=LEVEL, late=10)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("kind", ["ros1", "sqlite"])
def test_a_damaged_bag_is_reported_in_one_sentence(kind: str, share: float, tmp_path: Path) -> None:
    path = bag_of(tmp_path, kind).close()
    file = path if kind == "ros1" else next(path.glob("*.db3"))
    data = file.read_bytes()
    file.write_bytes(data[: int(share * len(data))])
    reason = "cut off|no bag of ROS 1" if kind == "ros1" else "cut off|no laser scans"
    with pytest.raises(ChefbotError, match=reason):
        read_drive(path, ONLY_TOPICS)


def test_bags_that_are_not_there_are_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match="does not exist"):
        read_drive(tmp_path / "none.bag", ONLY_TOPICS)
    path = bag_of(tmp_path, "sqlite").close()
    (path / "metadata.yaml").unlink()
    for given in (path, next(path.glob("*.db3"))):
        with pytest.raises(ChefbotError, match=r"has no metadata\.yaml; `ros2 bag reindex`"):
            read_drive(given, ONLY_TOPICS)


def test_a_bag_without_its_library_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, imported = bag_of(tmp_path, "ros1").close(), builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.startswith("rosbags"):
            raise ImportError(name)
        return imported(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ChefbotError, match=r"pip install 'chefbot\[rosbags\]'"):
        read_drive(path, ONLY_TOPICS)


@pytest.mark.parametrize("laser", [(11.0, 0.0, 0.0), (math.nan, 0.0, 0.0)])
def test_a_pose_that_no_laser_has_is_refused(laser: tuple[float, float, float]) -> None:
    with pytest.raises(ChefbotError, match="--laser"):
        BagChoice.of("", "", laser)


def test_bags_that_need_the_library_are_known_by_their_files(tmp_path: Path) -> None:
    (tmp_path / "sqlite").mkdir()
    (tmp_path / "sqlite" / "drive_0.db3").touch()
    assert needs_rosbags(tmp_path / "sqlite") and needs_rosbags(tmp_path / "sqlite" / "drive_0.db3")
    assert (
        needs_rosbags(Path("drive.bag")) and not needs_rosbags(tmp_path) and not needs_rosbags(Path("a.mcap"))
    )


def test_transforms_in_a_circle_are_refused() -> None:
    loop = [
        TransformStamped(Header.of(0, a), b, Transform(Vector3(), Quaternion()))
        for a, b in (("a", "b"), ("b", "a"))
    ]
    with pytest.raises(ChefbotError, match="circle"):
        laser_mount(loop, "a", "c")


def test_a_turned_scan_begins_with_the_beam_that_was_last() -> None:
    scan = LaserScan(
        Header.of(10**9, "laser"), -1.0, 0.5, 0.75, 0.1, 0.2, 0.1, 9.0, np.array([1, 2, 3], np.float32)
    )
    turned = turned_upright(scan)
    assert turned.header.stamp.ns == pytest.approx(1_200_000_000, abs=10) and list(turned.ranges) == [
        3.0,
        2.0,
        1.0,
    ]
    assert (turned.angle_min, turned.time_increment) == pytest.approx((-0.5, -0.1))
    again = turned_upright(turned)
    assert again.header.stamp.ns == pytest.approx(10**9, abs=10) and list(again.ranges) == [1.0, 2.0, 3.0]
