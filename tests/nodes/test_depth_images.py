"""Depth images of other cameras than the robot file's: their camera_info counts, and unusable ones are bad input."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.sensor_msgs import CameraInfo, Image, LaserScan, RegionOfInterest
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.cameras.depth_to_scan import NO_CAMERA
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

NODES = {"depth_to_scan": NodeEntry(kind="chefbot.nodes.cameras.depth_to_scan:DepthToScanNode")}
WALL = 2.0
"""Distance of a wall across the whole view, m."""


class DepthBench:
    """The node of a robot with its inputs at hand; what it publishes is kept by topic."""

    def __init__(self, robot: str = "chefbot") -> None:
        self.system = NodeContainer(Loop(StepClock()), load_robot(robot), 1)
        self.system.isolate_faults(lambda _: None)
        self.system.launch(Launch(name="depth", description="", args={}, nodes=NODES))
        self.published: dict[str, list[Any]] = {}
        self.system.loop.add_observer(
            lambda one: self.published.setdefault(one.topic, []).append(one.message)
        )
        self.ns = 0

    def send(self, topic: str, message: Any) -> None:
        loop = self.system.loop
        loop.publish(f"camera/depth/{topic}", message, "test", from_device=True)
        self.ns += 100_000_000
        loop.schedule(self.ns, 0, lambda: None)  # time passes with events
        loop.run(until_ns=self.ns)

    def send_wall(self, width: int, height: int) -> None:
        pixels = np.full((height, width), 1000 * WALL, np.uint16)
        pixels[3 * height // 5 :] = 0  # a wall does not continue below the floor
        self.send("image_raw", Image.of(Header.of(self.ns, "camera"), "16UC1", pixels))

    @property
    def reasons(self) -> str:
        assert self.system.faults is not None and self.system.faults.bug_count == 0
        return "; ".join(self.system.faults.counts)

    def newest(self, topic: str) -> Any:
        return self.published[topic][-1]


def info(
    width: int, height: int, focal: float, cx: float, cy: float, fy: float | None = None, **more: Any
) -> CameraInfo:
    k = np.array([focal, 0.0, cx, 0.0, focal if fy is None else fy, cy, 0.0, 0.0, 1.0])
    return CameraInfo(Header.of(0, "camera"), height, width, k=k, **more)


def test_images_of_a_robot_without_a_camera_are_refused() -> None:
    bench = DepthBench("jackal")
    bench.send("camera_info", info(640, 480, 500.0, 320.0, 240.0))
    bench.send_wall(3, 2)
    assert NO_CAMERA in bench.reasons


def test_images_of_another_size_wait_1_s_for_camera_info() -> None:
    bench = DepthBench()
    for _ in range(9):
        bench.send_wall(640, 480)
    assert not bench.reasons
    for _ in range(3):
        bench.send_wall(640, 480)
    assert "640 x 480" in bench.reasons and "camera_info" in bench.reasons
    assert "scan" not in bench.published


def test_the_intrinsics_of_camera_info_place_the_image() -> None:
    bench = DepthBench()
    bench.send_wall(640, 480)
    bench.send("camera_info", info(640, 480, 554.0, 300.0, 250.0))
    bench.send_wall(640, 480)
    scan: LaserScan = bench.newest("scan")
    assert len(scan.ranges) == 640
    assert scan.angle_max == pytest.approx(math.atan(300.0 / 554.0), abs=1e-6)
    assert scan.angle_min == pytest.approx(math.atan((300.0 - 639.0) / 554.0), abs=1e-6)
    angles = scan.angle_min + scan.angle_increment * np.arange(640)
    # A bin is at most as far from its column as a column is wide
    assert np.abs(scan.ranges * np.cos(angles) - WALL).max() < 2.0 * WALL / 554.0
    obstacles: ObstacleScan = bench.newest("obstacles")
    assert np.isfinite(obstacles.ranges).all() and len(obstacles.ranges) == 320


def test_a_binned_region_gives_the_same_scan() -> None:
    whole, part = DepthBench(), DepthBench()
    whole.send("camera_info", info(640, 480, 554.0, 319.5, 239.5))
    whole.send_wall(640, 480)
    region = RegionOfInterest(160, 120, 240, 320)
    part.send("camera_info", info(640, 480, 554.0, 319.5, 239.5, roi=region, binning_x=2, binning_y=2))
    part.send_wall(160, 120)
    full, binned = whole.newest("scan"), part.newest("scan")
    assert len(binned.ranges) == 160
    # columns 160.5 and 478.5 are the outermost pixel centres of the region
    assert binned.angle_max == pytest.approx(math.atan((319.5 - 160.5) / 554.0), abs=1e-6)
    assert binned.angle_min > full.angle_min and binned.ranges[80] == pytest.approx(
        full.ranges[320], abs=0.02
    )


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        (info(320, 240, 0.0, 160.0, 120.0), "calibrate"),
        (info(320, 240, math.nan, 160.0, 120.0), "calibrate"),
        (info(320, 240, 300.0, math.nan, 120.0), "optical axis"),
        (info(320, 240, 300.0, 500.0, 120.0), "optical axis"),
        (info(0, 0, 300.0, 0.0, 0.0), "no image"),
        (info(4_000_000, 1, 300.0, 0.0, 0.0), "too large"),
        (info(320, 240, 1e-3, 160.0, 120.0), "degrees"),
        (info(320, 240, 1e9, 160.0, 120.0), "degrees"),
        (info(640, 480, 554.0, 320.0, 240.0, 1e-320), "check fx and fy"),
    ],
)
def test_a_camera_info_of_no_depth_camera_is_refused(given: CameraInfo, reason: str) -> None:
    bench = DepthBench()
    bench.send("camera_info", given)
    assert reason in bench.reasons
    width = load_robot("chefbot").sensors.depth_camera.width  # type: ignore[union-attr]
    bench.send_wall(width, 240)
    assert len(bench.newest("scan").ranges) == width  # the robot file's camera still counts


def test_another_view_and_distortion_are_reported_once() -> None:
    bench = DepthBench()
    for _ in range(3):
        bench.send("camera_info", info(640, 480, 320.0, 319.5, 239.5, d=np.array([0.1, 0.0, 0.0, 0.0, 0.0])))
    notices: list[String] = bench.published["camera/notice"]
    assert ["90 degrees" in one.data for one in notices] == [True, False]
    assert "distorted" in notices[1].data
