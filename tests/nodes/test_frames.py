"""Tests that /tf_static agrees with the URDF, including the orientation of tilted sensors."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import msgspec
import mujoco
import numpy as np
import pytest
from tests.support.rotations import matrix

from chefbot.design.export.urdf import urdf
from chefbot.design.export.urdf_frames import DEPTH_FRAME, fixed_frames
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.robot_state_publisher import transform
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.transform_buffer import TransformBuffer

PITCH, YAW = 0.35, 0.2


def tilted() -> Robot:
    """Return the Chefbot with a camera that is pitched and yawed."""
    robot = load_robot("chefbot")
    camera = robot.sensors.depth_camera
    assert camera is not None
    mount = msgspec.structs.replace(camera.mount, pitch=PITCH, yaw=YAW)
    camera = msgspec.structs.replace(camera, mount=mount)
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, depth_camera=camera))


@pytest.mark.parametrize(
    "robot", [*map(load_robot, sorted(built_in_robots())), tilted()], ids=lambda r: r.name
)
def test_each_transform_equals_the_urdf_joint(robot: Robot) -> None:
    transforms = {frame.name: transform(0, frame) for frame in fixed_frames(robot)}
    compiled = mujoco.MjModel.from_xml_string(urdf(robot))
    joints = ET.fromstring(urdf(robot)).findall("joint[@type='fixed']")
    assert len(joints) == len(transforms)
    for joint in joints:
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None and child is not None
        published, body = transforms[child.attrib["link"]], compiled.body(child.attrib["link"])
        at, turn = published.transform.translation, published.transform.rotation
        assert published.header.frame_id == parent.attrib["link"]
        assert (at.x, at.y, at.z) == pytest.approx(tuple(body.pos), abs=1e-8)
        assert matrix([turn.w, turn.x, turn.y, turn.z]) == pytest.approx(matrix(list(body.quat)), abs=1e-7)


def test_a_tilted_camera_is_tilted_in_the_transform() -> None:
    frames = {frame.name: transform(0, frame) for frame in fixed_frames(tilted())}
    turn = frames["camera_link"].transform.rotation
    ahead = matrix([turn.w, turn.x, turn.y, turn.z])[:, 0]
    assert ahead == pytest.approx(
        [np.cos(PITCH) * np.cos(YAW), np.cos(PITCH) * np.sin(YAW), -np.sin(PITCH)], abs=1e-12
    )


def test_the_camera_position_is_that_of_its_mount() -> None:
    robot, buffer = tilted(), TransformBuffer()
    buffer.add_transforms(TFMessage(tuple(transform(0, frame) for frame in fixed_frames(robot))), static=True)
    camera = robot.sensors.depth_camera
    assert camera is not None
    assert buffer.lookup("base_footprint", DEPTH_FRAME) == pytest.approx(camera.mount.planar, abs=1e-12)
