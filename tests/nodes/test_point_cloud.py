"""The point cloud of a robot's depth camera lies where the camera sees a wall."""

from __future__ import annotations

from typing import Any

import numpy as np

from chefbot.msgs.sensor_msgs import CameraInfo, Image, PointCloud2
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.cameras.point_cloud import PointCloudNode
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

KIND = f"{PointCloudNode.__module__}:{PointCloudNode.__name__}"


def clouds(robot: str, messages: list[tuple[str, Any]], step: int = 4) -> list[PointCloud2]:
    """Return what the node publishes after messages of the camera."""
    system = NodeContainer(Loop(StepClock()), load_robot(robot), 1)
    system.launch(
        Launch(
            name="points",
            description="",
            args={},
            nodes={"points": NodeEntry(kind=KIND, params={"step": step})},
        )
    )
    published: list[PointCloud2] = []
    system.loop.add_observer(
        lambda one: published.append(one.message) if isinstance(one.message, PointCloud2) else None
    )
    for topic, message in messages:
        system.loop.publish(f"camera/depth/{topic}", message, "test", from_device=True)
    system.loop.run(until_ns=100_000_000)
    return published


def wall(width: int, height: int, stamp_ns: int = 0) -> Image:
    return Image.of(Header.of(stamp_ns, "camera"), "16UC1", np.full((height, width), 2000, np.uint16))


def test_a_wall_ahead_is_a_plane_in_the_optical_frame() -> None:
    camera = load_robot("chefbot").sensors.depth_camera
    assert camera is not None
    (cloud,) = clouds("chefbot", [("image_raw", wall(camera.width, camera.height, 70_000_000))])
    assert (cloud.header.frame_id, cloud.header.stamp.ns) == ("camera_depth_optical_frame", 70_000_000)
    assert (cloud.width, cloud.height) == (-(-camera.width // 4), -(-camera.height // 4))
    points = np.frombuffer(cloud.data.tobytes(), "<f4").reshape(-1, 3)
    assert np.allclose(points[:, 2], 2.0)
    assert points[0, 0] < 0.0 < points[-1, 0] and points[0, 1] < 0.0 < points[-1, 1]  # x right, y down


def test_another_camera_is_known_from_its_camera_info() -> None:
    k = np.array([100.0, 0.0, 49.5, 0.0, 100.0, 29.5, 0.0, 0.0, 1.0])
    info = CameraInfo(Header(), 60, 100, d=np.zeros(5), k=k, r=np.eye(3).reshape(9), p=np.zeros(12))
    before, after = ("image_raw", wall(100, 60, 1)), ("image_raw", wall(100, 60, 2))
    (cloud,) = clouds("chefbot", [before, ("camera_info", info), after], step=1)
    points = np.frombuffer(cloud.data.tobytes(), "<f4").reshape(60, 100, 3)
    assert cloud.header.stamp.ns == 2 and np.allclose(points[0, 0], [-0.99, -0.59, 2.0])


def test_a_robot_without_depth_camera_has_no_point_cloud() -> None:
    assert clouds("jackal", [("image_raw", wall(320, 240))]) == []
