"""The web UI's device displays frames, joints, the URDF and the point cloud of the depth camera."""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import NoParams
from chefbot.ui.layers import LAYERS
from chefbot.ui.missions.model_device import ModelDevice

OPTICAL = Header.of(0, "camera_optical")


class ModelPage(ModelDevice):
    """The base class alone."""

    params: NoParams


class Page:
    """The device on a loop, and the layers that it displays."""

    def __init__(self) -> None:
        self.nodes = NodeRunner({"page": f"{__name__}:ModelPage"}, {})
        self.device: Any = self.nodes.system.nodes["page"]
        self.layers: dict[str, Any] = {}
        self.device._server = SimpleNamespace(set_layer=self.layers.__setitem__)

    def publish(self, topic: str, message: Any) -> None:
        self.nodes.loop.publish(topic, message, "test")
        self.nodes.run(0.05)


@pytest.fixture
def page() -> Page:
    return Page()


def transform(parent: str, child: str, x: float) -> TransformStamped:
    return TransformStamped.of(0, parent, child, SE2(x, 0.0, 0.0))


def test_moving_frames_are_displayed_with_their_newest_pose(page: Page) -> None:
    page.device._show_moving_parts()
    assert page.layers == {}
    page.publish("tf", TFMessage((transform("odom", "base_link", 1.0), transform("map", "odom", 3.0))))
    page.publish("tf", TFMessage((transform("odom", "base_link", 2.0),)))
    page.device._show_moving_parts()
    found = {view.name: (view.parent, view.at[0]) for view in page.layers["frames"]}
    assert found == {"base_link": ("odom", 2.0), "odom": ("map", 3.0)}


def test_fixed_frames_are_displayed_when_they_arrive(page: Page) -> None:
    page.publish("tf_static", TFMessage((transform("base_link", "laser", 0.1),)))
    page.publish("tf_static", TFMessage((transform("base_link", "camera", 0.2),)))
    assert [view.name for view in page.layers["fixed_frames"]] == ["laser", "camera"]


def test_joints_turn_with_the_encoders(page: Page) -> None:
    half_turn = round(page.device.robot.motor.ticks_per_turn / 2)
    page.publish("wheel_ticks", WheelTicks(Header.of(0, ""), half_turn, 0))
    page.device._show_moving_parts()
    left, right = page.layers["joints"].values()
    assert (left, right) == pytest.approx((math.pi, 0.0), abs=0.01)


def test_the_urdf_is_passed_on(page: Page) -> None:
    page.publish("robot_description", String("<robot/>"))
    assert page.layers["description"] == "<robot/>"


def depth_pictures() -> Iterator[Any]:
    """Images of a floor 1.5 m away with one pixel without depth, in metres and in millimetres."""
    metres = np.full((4, 6), 1.5, np.float32)
    metres[1, 2] = np.nan
    millimetres = np.where(np.isfinite(metres), 1500, 0).astype(np.uint16)
    swapped = Image.of(OPTICAL, "16UC1", millimetres.byteswap())
    yield pytest.param(Image.of(OPTICAL, "32FC1", metres), id="simulated")
    yield pytest.param(Image.of(OPTICAL, "16UC1", millimetres), id="camera")
    yield pytest.param(msgspec.structs.replace(swapped, is_bigendian=1), id="big endian")


@pytest.mark.parametrize("image", [*depth_pictures()])
def test_depth_in_either_unit_is_displayed_in_millimetres(page: Page, image: Image) -> None:
    page.publish("camera/depth/image_raw", image)
    assert "depth" not in page.layers  # without intrinsics it has no points
    k = np.array([5.0, 0.0, 2.5, 0.0, 5.0, 1.5, 0.0, 0.0, 1.0])
    page.publish("camera/depth/camera_info", CameraInfo(OPTICAL, 4, 6, k=k))
    page.publish("camera/depth/image_raw", image)
    shown: Any = LAYERS["depth"].validate(page.layers["depth"])
    expected = np.full((4, 6), 1500)
    expected[1, 2] = 0
    assert (shown.pinhole, shown.frame) == ({"focal": 5.0, "cx": 2.5, "cy": 1.5}, "camera_optical")
    assert np.array_equal(shown.millimetres, expected)
