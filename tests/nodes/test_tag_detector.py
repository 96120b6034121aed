"""The simulated robot's colour camera shows the tags of the building, and their frames are where they hang."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.support.tag_pictures import K, camera_robot, picture_of_tag

from chefbot.msgs.apriltag_msgs import AprilTagDetectionArray
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

WORLD = """
name: tagged
walls:
  - {{start: [-2 m, -2 m], end: [4 m, -2 m]}}
  - {{start: [4 m, -2 m], end: [4 m, 2 m]}}
  - {{start: [4 m, 2 m], end: [-2 m, 2 m]}}
  - {{start: [-2 m, 2 m], end: [-2 m, -2 m]}}
tags:
  - {{id: {number}, size: 20 cm, x: {x} m, y: {y} m, yaw: {yaw} deg, z: {z} m}}
places:
  home: {{x: 0 m, y: 0 m}}
"""
DETECTOR = NodeEntry(kind="chefbot.nodes.cameras.tag_detector:TagDetectorNode")


def run(
    robot: Robot, nodes: dict[str, NodeEntry], seconds: float, messages: Any = ()
) -> dict[str, list[Any]]:
    """Return what the nodes publish after messages of a camera, by topic."""
    system = NodeContainer(Loop(StepClock()), robot, 1)
    faults: list[Any] = []
    system.isolate_faults(faults.append)
    system.launch(Launch(name="tags", description="", args={}, nodes=nodes))
    published: dict[str, list[Any]] = {"faults": faults}
    system.loop.add_observer(lambda one: published.setdefault(one.topic, []).append(one.message))
    for topic, message in messages:
        system.loop.publish(f"camera/color/{topic}", message, "test", from_device=True)
    system.loop.run(until_ns=round(seconds * 1e9))
    system.stop()
    return published


@pytest.mark.parametrize(
    ("number", "x", "y", "z", "yaw"),
    [(3, 3.93, 0.3, 0.4, 180.0), (586, 2.2, -0.4, 0.9, 150.0), (40, 1.6, 0.6, 0.2, -150.0)],
)
def test_a_tag_has_its_frame_where_it_hangs(
    tmp_path: Path, number: int, x: float, y: float, z: float, yaw: float
) -> None:
    world = tmp_path / "world.yaml"
    world.write_text(WORLD.format(number=number, x=x, y=y, z=z, yaw=yaw))
    simulator = NodeEntry(
        kind="chefbot.sim.device:SimulatorDevice", params={"world": str(world), "profile": "perfect"}
    )
    seen = run(camera_robot(), {"simulator": simulator, "tag_detector": DETECTOR}, 0.5)
    array = seen["apriltag/detections"][-1]
    assert isinstance(array, AprilTagDetectionArray)
    (detection,) = array.detections
    assert (detection.family, detection.id) == ("tag36h11", number)
    corners = np.array([(one.x, one.y) for one in detection.corners])
    assert corners.mean(axis=0) == pytest.approx([detection.centre.x, detection.centre.y], abs=3.0)
    (transform,) = seen["tf"][-1].transforms
    assert transform.header == array.header and transform.child_frame_id == f"tag36h11:{number}"
    assert transform.header.frame_id == "color_camera_optical_frame"
    # Optical frame to base_link: z forward, x right, y down, at the camera's mount.
    to_base = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    t, q = transform.transform.translation, transform.transform.rotation
    at = to_base @ [t.x, t.y, t.z] + [0.12, 0.0, 0.16]
    assert math.dist(at, (x, y, z)) < 0.015 * math.hypot(x, y)
    turn = to_base @ Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    front = np.array([math.cos(math.radians(yaw)), math.sin(math.radians(yaw)), 0.0])
    assert turn[:, 2] @ front > math.cos(math.radians(10.0)), "z comes out of the tag"
    assert turn[2, 1] > 0.97, "y points up"


def test_another_lens_is_known_from_its_camera_info() -> None:
    picture = picture_of_tag(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.8]), size=0.2)
    image = Image.of(Header.of(1, "lens"), "rgb8", picture)
    info = CameraInfo(Header(), 480, 640, d=np.zeros(5), k=K.reshape(9))
    for factor in (1.0, 2.0):
        scaled = CameraInfo(
            Header(), 480, 640, d=np.zeros(5), k=info.k * [factor, 1, 1, 1, factor, 1, 1, 1, 1]
        )
        seen = run(camera_robot(), {"tags": DETECTOR}, 0.1, [("camera_info", scaled), ("image_raw", image)])
        (transform,) = seen["tf"][0].transforms
        assert transform.transform.translation.z == pytest.approx(0.8 * factor, rel=0.01)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
def test_colour_and_grey_pictures_are_read(encoding: str) -> None:
    picture = picture_of_tag(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.8]))
    pixels = picture[:, :, 0] if encoding == "mono8" else picture
    seen = run(camera_robot(), {"tags": DETECTOR}, 0.1, [("image_raw", Image.of(Header(), encoding, pixels))])
    assert [one.id for one in seen["apriltag/detections"][0].detections] == [7]


def test_an_image_of_depth_is_refused_by_its_encoding() -> None:
    depth = Image.of(Header(), "16UC1", np.zeros((480, 640), np.uint16))
    seen = run(camera_robot(), {"tags": DETECTOR}, 0.1, [("image_raw", depth)])
    assert "apriltag/detections" not in seen and "16UC1" in str(seen["faults"][0])


def test_a_robot_without_tags_detects_none() -> None:
    image = Image.of(Header(), "rgb8", np.zeros((480, 640, 3), np.uint8))
    seen = run(load_robot("chefbot_lidar"), {"tags": DETECTOR}, 0.1, [("image_raw", image)])
    assert "apriltag/detections" not in seen and not seen["faults"]
