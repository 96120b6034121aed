"""The device of depth cameras: images in time, silence, a cable that is pulled, and the end."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import msgspec
import numpy as np
import pytest
from tests.support.waiting import PATIENCE

from chefbot.devices.cameras import depth_camera
from chefbot.devices.cameras.camera import CameraError, CameraFrame, Intrinsics, StreamRequest
from chefbot.devices.cameras.camera_device import MIN_PERIOD_SHARE
from chefbot.devices.cameras.depth_camera import NO_DRIVER, DepthCameraDevice
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import CameraInfo, Image
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import WallClock, wall_ns
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Context, NoParams
from chefbot.runtime.transform_buffer import TransformBuffer

AGE_NS = 80_000_000
"""Time between exposure and arrival of an image."""


class SoftwareCamera:
    """A camera on a cable: sends images at 100 Hz while it is plugged in, unless it hangs."""

    name = "Software camera 7"

    def __init__(self) -> None:
        self.plugged, self.hangs, self.intrinsics = True, False, Intrinsics(300.0, 300.0, 159.5, 119.5)
        self.opened = self.closed = 0
        self.fails = False
        self.requests: list[StreamRequest] = []

    def open(self, request: StreamRequest) -> SoftwareCamera:
        if not self.plugged:
            raise CameraError("no camera is connected")
        self.requests.append(request)
        self.opened += 1
        return self

    def read(self, timeout: float) -> CameraFrame | None:
        if not self.plugged:
            raise CameraError("the connection broke")
        if self.fails:
            self.fails = False
            raise ValueError("of the SDK")
        time.sleep(timeout if self.hangs else 0.01)
        pixels = np.full((240, 320), 1500, np.uint16)
        return None if self.hangs else CameraFrame(pixels, self.intrinsics, wall_ns() - AGE_NS)

    def close(self) -> None:
        self.closed += 1


class Driver:
    """The device on a real clock, and what it has published."""

    def __init__(self, robot: Robot) -> None:
        self.loop = Loop(WallClock(), time.time_ns())
        self.messages: dict[str, list[Message]] = {}
        self.loop.add_observer(lambda one: self.messages.setdefault(one.topic, []).append(one.message))
        self.device = DepthCameraDevice(Context("camera", self.loop, robot, TransformBuffer()), NoParams())
        self.device.start()

    def until(self, condition: Callable[[], bool], what: str) -> None:
        limit = time.monotonic() + PATIENCE
        self.loop.run(until=lambda: condition() or time.monotonic() > limit)
        assert condition(), f"waited {PATIENCE} s for {what}: {self.health}"

    @property
    def images(self) -> list[Image]:
        return [one for one in self.messages.get("camera/depth/image_raw", []) if isinstance(one, Image)]

    @property
    def health(self) -> DiagnosticStatus:
        arrays = [one for one in self.messages.get("diagnostics", []) if isinstance(one, DiagnosticArray)]
        return arrays[-1].status[0] if arrays else DiagnosticStatus()

    @property
    def notices(self) -> list[str]:
        return [one.data for one in self.messages.get("camera/notice", []) if isinstance(one, String)]


def robot_with(driver: str) -> Robot:
    robot = load_robot("chefbot")
    camera = msgspec.structs.replace(robot.sensors.depth_camera, driver=driver)  # type: ignore[type-var]
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, depth_camera=camera))


@pytest.fixture
def camera(monkeypatch: pytest.MonkeyPatch) -> SoftwareCamera:
    camera = SoftwareCamera()
    monkeypatch.setattr(depth_camera, "opener_of", lambda _: camera.open)
    return camera


@pytest.fixture
def driver(camera: SoftwareCamera) -> Iterator[Driver]:
    driver = Driver(robot_with("realsense"))
    yield driver
    driver.device.stop()
    assert camera.closed == camera.opened


def test_images_have_their_intrinsics_and_exposure_time(driver: Driver, camera: SoftwareCamera) -> None:
    driver.until(lambda: len(driver.images) > 3, "images")
    image = driver.images[-1]
    assert (image.encoding, image.width, image.height) == ("16UC1", 320, 240)
    assert driver.loop.now_ns - image.header.stamp.ns >= AGE_NS
    infos = [one for one in driver.messages["camera/depth/camera_info"] if isinstance(one, CameraInfo)]
    assert infos[0].k[0] == 300.0 and infos[0].header == driver.images[0].header
    spec = load_robot("chefbot").sensors.depth_camera
    assert spec is not None
    assert camera.requests == [StreamRequest("auto", spec.width, spec.height, spec.rate)]


@pytest.mark.slow
def test_a_camera_faster_than_the_robot_file_skips_images(driver: Driver) -> None:
    driver.until(lambda: len(driver.images) > 20, "images")
    span = (driver.images[20].header.stamp.ns - driver.images[0].header.stamp.ns) / 1e9
    rate = driver.device.robot.sensors.depth_camera.rate  # type: ignore[union-attr]
    assert span > 20 * MIN_PERIOD_SHARE / rate - 0.2  # twenty of its own periods take 0.2 s


@pytest.mark.slow
def test_a_pulled_cable_is_reported_once_then_reconnected(driver: Driver, camera: SoftwareCamera) -> None:
    driver.until(lambda: bool(driver.images), "an image")
    camera.plugged = False
    driver.until(lambda: driver.health.level == ERROR, "the fault")
    driver.until(lambda: "no camera" in driver.health.message.lower(), "another attempt")
    camera.plugged, count = True, len(driver.images)
    driver.until(lambda: driver.health.level == OK and len(driver.images) > count, "images")
    assert len(driver.notices) == len(set(driver.notices)) + 1  # its name twice, each warning once


@pytest.mark.slow
def test_a_camera_that_hangs_is_opened_again(driver: Driver, camera: SoftwareCamera) -> None:
    driver.until(lambda: bool(driver.images), "an image")
    camera.hangs = True
    driver.until(lambda: "has sent no image for 2 s" in driver.health.message, "the fault")
    camera.hangs, count = False, len(driver.images)
    driver.until(lambda: len(driver.images) > count, "images")
    assert camera.opened >= 2


@pytest.mark.slow
def test_any_exception_of_an_sdk_is_reported(driver: Driver, camera: SoftwareCamera) -> None:
    driver.until(lambda: bool(driver.images), "an image")
    camera.fails, count = True, len(driver.images)
    driver.until(lambda: any("ValueError: of the SDK" in text for text in driver.notices), "the report")
    driver.until(lambda: driver.health.level == OK and len(driver.images) > count, "images")


def test_impossible_intrinsics_are_a_fault_of_the_camera(driver: Driver, camera: SoftwareCamera) -> None:
    camera.intrinsics = Intrinsics(0.0, 0.0, 0.0, 0.0)
    count = len(driver.images)
    driver.until(lambda: driver.health.level == ERROR, "the fault")
    assert "fx, fy > 0" in driver.health.message and len(driver.images) <= count + 1


def test_without_a_driver_another_node_sends_the_images() -> None:
    for robot, announcement in ((load_robot("chefbot"), NO_DRIVER), (load_robot("jackal"), "")):
        driver = Driver(robot)
        assert driver.device.announcement == announcement
        driver.device.publish_health()
        driver.device.stop()
        assert not driver.messages
