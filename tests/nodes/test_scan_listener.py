"""Nodes that need scans: they get each with its odometry and without skew, and report when none come."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.scans.deskewing import when_deskewed
from chefbot.nodes.scans.scan_listener import MAX_SILENCE_NS, ScanListenerNode
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import NoParams
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.transform_buffer import TransformBuffer
from chefbot.scan.deskewing import deskewed, knot_times

SECOND = 1_000_000_000
KINDS = {"mapper": "chefbot.nodes.gmapping:GmappingNode", "localization": "chefbot.nodes.amcl:AmclNode"}
LIDAR_MOUNT, BEAMS = SE2(0.1, 0.0, math.pi / 2), 90


def scan_at(time: float, sweep: float = 0.0, frame: str = "laser") -> LaserScan:
    """Return a scan of a round room whose beams are measured within `sweep` seconds; negative: clockwise."""
    step = 2.0 * math.pi / BEAMS
    ranges = np.full(BEAMS, 2.0, np.float32)
    stamp = Header.of(round(time * SECOND), frame)
    increment = sweep / (BEAMS - 1)
    return LaserScan(stamp, -math.pi, math.pi - step, step, increment, 0.1, 0.1, 8.0, ranges)


class Odometry:
    """Transforms of a robot that drives at 1 m/s along x and turns at 1 rad/s, and the scans given with poses."""

    def __init__(self) -> None:
        self.tf = TransformBuffer()
        self.given: list[tuple[LaserScan, SE2]] = []

    def pose(self, time: float) -> SE2:
        return SE2(time, 0.0, time)

    def known_up_to(self, time: float, start: float = 0.0) -> None:
        for stamp in np.arange(start, time + 1e-9, 0.05).tolist():
            self._add("odom", "base_link", self.pose(stamp), stamp, static=False)

    def mount(self) -> None:
        self._add("base_link", "laser", LIDAR_MOUNT, 0.0, static=True)

    def _add(self, parent: str, child: str, pose: SE2, time: float, *, static: bool) -> None:
        stamped = TransformStamped.of(round(time * SECOND), parent, child, pose)
        self.tf.add_transforms(TFMessage((stamped,)), static)

    def request(self, scan: LaserScan, frame: str = "base_link") -> None:
        when_deskewed(self.tf, scan, frame, lambda scan, pose: self.given.append((scan, pose)))


def assert_close(found: SE2, expected: SE2) -> None:
    assert tuple(found) == pytest.approx(tuple(expected), abs=1e-6)


@pytest.mark.parametrize("frame", ["base_link", "laser"])
def test_a_scan_of_one_instant_has_the_pose_of_that_instant(frame: str) -> None:
    odometry, scan = Odometry(), scan_at(1.02)
    odometry.mount()
    odometry.request(scan, frame)
    odometry.known_up_to(1.0)
    assert odometry.given == [], "its odometry has not come yet"
    odometry.known_up_to(1.05, 1.05)
    ((given, pose),) = odometry.given
    at = odometry.pose(1.02)
    assert given is scan
    assert_close(pose, at if frame == "base_link" else at @ LIDAR_MOUNT)


@pytest.mark.parametrize(("sweep", "end"), [(0.1, 1.12), (-0.1, 1.02)])
def test_a_swept_scan_waits_for_all_of_its_poses(sweep: float, end: float) -> None:
    odometry, scan = Odometry(), scan_at(1.02, sweep)
    odometry.mount()
    odometry.request(scan)
    last = math.floor(end / 0.05) * 0.05
    odometry.known_up_to(last)
    assert odometry.given == []
    odometry.known_up_to(last + 0.05, last + 0.05)
    ((given, pose),) = odometry.given
    assert_close(pose, odometry.pose(1.02))
    poses = [odometry.pose(time / 1e9) @ LIDAR_MOUNT for time in knot_times(scan)]
    assert given.ranges == pytest.approx(deskewed(scan, poses).ranges, abs=1e-5, nan_ok=True)
    assert not np.array_equal(given.ranges, scan.ranges) and given.time_increment == 0.0


@pytest.mark.parametrize(("stamp", "sweep"), [(1.0, 0.1), (1.1, -0.1)])
def test_a_scan_that_began_before_the_first_odometry_is_left_out(stamp: float, sweep: float) -> None:
    odometry = Odometry()
    odometry.mount()
    odometry.request(scan_at(stamp, sweep))
    odometry.known_up_to(1.3, 1.05)
    assert odometry.given == []
    odometry.request(scan_at(stamp + 0.1, sweep))
    assert len(odometry.given) == 1


def test_a_scan_in_an_unknown_frame_keeps_its_skew() -> None:
    odometry, scan = Odometry(), scan_at(1.0, 0.1)
    odometry.known_up_to(1.3)
    odometry.request(scan)
    assert odometry.given[0][0] is scan, "base_link is known, the lidar is not"


class Listener(ScanListenerNode):
    """Keeps the scans that it gets; wants none while `asleep`."""

    params: NoParams
    role = "The listener"
    asleep = False

    def start(self) -> None:
        super().start()
        self.scans: list[tuple[float, SE2]] = []

    @property
    def wants_scans(self) -> bool:
        return not self.asleep

    def process_scan(self, scan: LaserScan, odom: SE2) -> None:
        self.scans.append((scan.header.stamp.ns / SECOND, odom))


class Scene(NodeRunner):
    """A listener, and odometry and scans of a robot that drives along x at 1 m/s."""

    def __init__(self) -> None:
        super().__init__({"listener": f"{__name__}:Listener"}, {})
        self.node: Any = self.system.nodes["listener"]

    def drive(self, seconds: float, *, scans: bool = True) -> None:
        for _ in range(round(10 * seconds)):
            self.run(0.1)
            now = self.loop.now_ns
            pose = SE2(now / SECOND, 0.0, 0.0)
            for child, at in (("base_link", pose), ("laser", SE2(0.0, 0.0, 0.0))):
                parent = "odom" if child == "base_link" else "base_link"
                self.loop.publish("tf", TFMessage((TransformStamped.of(now, parent, child, at),)), "test")
            if scans:
                self.loop.publish("scan", scan_at(now / SECOND), "lidar", from_device=True)
        self.run(0.0)

    @property
    def notices(self) -> list[str]:
        return [one.data for one in self.messages("scan/notice")]


def test_each_scan_is_processed_with_its_odometry() -> None:
    scene = Scene()
    scene.drive(1.0)
    assert [time for time, _ in scene.node.scans] == pytest.approx([0.1 * k for k in range(1, 11)])
    assert all(pose.x == pytest.approx(time) for time, pose in scene.node.scans)
    assert scene.notices == []


def test_scans_that_nobody_wants_are_not_missed() -> None:
    scene = Scene()
    scene.node.asleep = True
    scene.drive(5.0)
    assert scene.node.scans == [] and scene.notices == []
    scene.node.asleep = False
    scene.drive(0.5)
    assert len(scene.node.scans) == 5


def test_each_silence_is_reported_once_with_its_end() -> None:
    scene = Scene()
    scene.drive(1.0)
    for silence in (1, 2):
        scene.drive(6.0, scans=False)
        assert len(scene.notices) == 2 * silence - 1
        assert scene.notices[-1].startswith("The listener has received no scan for 2 s: look at the lidar")
        scene.drive(0.5)
        assert scene.notices[-1] == "The listener receives scans again."


@pytest.mark.parametrize("silence", [2.0, 3.2])
def test_a_short_silence_is_not_reported(silence: float) -> None:
    scene = Scene()
    scene.drive(1.0)
    scene.drive(silence, scans=False)
    assert bool(scene.notices) == (silence > MAX_SILENCE_NS / SECOND)


@pytest.mark.parametrize("role", KINDS)
def test_missing_scans_are_reported_once_within_three_seconds(role: str) -> None:
    loop = Loop(StepClock())
    notices: list[tuple[int, Any]] = []
    loop.add_observer(
        lambda one: notices.append((one.time_ns, one.message)) if one.topic == "scan/notice" else None
    )
    system = NodeContainer(loop, load_robot("chefbot_lidar"), 1)
    system.launch(Launch(name="test", description="", args={}, nodes={"node": NodeEntry(kind=KINDS[role])}))
    loop.run(until_ns=10 * SECOND)
    (time_ns, message), *others = notices
    assert time_ns <= 3 * SECOND and not others
    assert role in message.data.lower() and "lidar" in message.data
    loop.publish("scan", scan_at(10.0), "lidar", from_device=True)
    loop.run(until_ns=11 * SECOND)
    assert len(notices) == 2 and "again" in str(notices[1][1])
    system.stop()


def test_a_robot_without_a_lidar_is_to_look_at_its_camera() -> None:
    loop = Loop(StepClock())
    system = NodeContainer(loop, load_robot("chefbot"), 1)
    nodes = {"node": NodeEntry(kind=f"{__name__}:Listener")}
    system.launch(Launch(name="test", description="", args={}, nodes=nodes))
    notices: list[Any] = []
    loop.subscribe("scan/notice", "test", notices.append)
    loop.run(until_ns=5 * SECOND)
    assert "look at the depth camera" in notices[0].data
    system.stop()
