"""The device of colour cameras plays a video file as a camera: images, health, and what is wrong with it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from tests.support.tag_pictures import camera_robot
from tests.support.waiting import PATIENCE

from chefbot.devices.cameras.camera import CameraError, StreamRequest
from chefbot.devices.cameras.camera_device import CameraDevice
from chefbot.devices.cameras.color_camera import NO_DRIVER, ColorCameraDevice
from chefbot.devices.cameras.video_source import VideoSource
from chefbot.msgs.diagnostic_msgs import ERROR, OK
from chefbot.msgs.idl.message import Message
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import Lens
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Context, NoParams
from chefbot.runtime.transform_buffer import TransformBuffer

RED, BLUE = (200, 30, 20), (20, 30, 200)
REQUEST = StreamRequest("", 640, 480, 10.0)


def video(path: Path, frames: int = 4, size: tuple[int, int] = (640, 480), rate: float = 20.0) -> Path:
    """Write a video whose first half is red and whose second is blue."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate, size)
    for i in range(frames):
        colour = RED if i < frames / 2 else BLUE
        writer.write(np.full((size[1], size[0], 3), colour[::-1], np.uint8))
    writer.release()
    return path


class Driver:
    """The device on a real clock, and what it has published."""

    def __init__(self, robot: Robot) -> None:
        self.loop = Loop(WallClock(), time.time_ns())
        self.messages: dict[str, list[Message]] = {}
        self.loop.add_observer(lambda one: self.messages.setdefault(one.topic, []).append(one.message))
        self.device = ColorCameraDevice(Context("camera", self.loop, robot, TransformBuffer()), NoParams())
        self.device.start()

    def until(self, condition: Callable[[], bool]) -> None:
        limit = time.monotonic() + PATIENCE
        self.loop.run(until=lambda: condition() or time.monotonic() > limit)
        assert condition(), self.health

    def of(self, topic: str) -> list:
        return self.messages.get(topic, [])

    @property
    def health(self):
        arrays = self.of("diagnostics")
        return arrays[-1].status[0] if arrays else None


@pytest.fixture
def driver(tmp_path: Path) -> Iterator[Driver]:
    lens = Lens(fx=600.0, fy=601.0, cx=310.0, cy=250.0, distortion=(0.1, -0.2, 0.0, 0.0, 0.05))
    driver = Driver(camera_robot(str(video(tmp_path / "video.avi")), lens=lens))
    yield driver
    driver.device.stop()


def test_images_are_published_with_their_intrinsics(driver: Driver) -> None:
    driver.until(lambda: len(driver.of("camera/color/image_raw")) > 9)
    images, (info, *_) = driver.of("camera/color/image_raw"), driver.of("camera/color/camera_info")
    colours = {tuple(np.round(one.pixels.mean(axis=(0, 1)), -1)) for one in images}
    assert colours == {RED, BLUE}  # not blue and red, and the file is played more than once
    assert images[0].header.frame_id == info.header.frame_id == "color_camera_optical_frame"
    assert info.k.reshape(3, 3).tolist() == [[600, 0, 310], [0, 601, 250], [0, 0, 1]]
    assert info.d.tolist() == [0.1, -0.2, 0.0, 0.0, 0.05]
    stamps = [one.header.stamp.ns for one in images]
    assert stamps == sorted(set(stamps))
    driver.until(lambda: driver.health is not None and driver.health.level == OK)


def test_a_file_that_is_gone_and_back_is_opened_again(tmp_path: Path) -> None:
    path = tmp_path / "late.avi"
    driver = Driver(camera_robot(str(path)))
    driver.until(lambda: driver.health is not None and "no camera" in driver.health.message)
    assert driver.health.level == ERROR and str(path) in driver.health.message
    video(path)
    driver.until(lambda: bool(driver.of("camera/color/image_raw")))
    assert any(str(path) in one.data for one in driver.of("color_camera/notice"))
    driver.device.stop()


def test_images_of_another_size_are_refused_by_name(tmp_path: Path) -> None:
    path = video(tmp_path / "small.avi", size=(320, 240))
    with pytest.raises(
        CameraError, match=r"320 x 240 pixels, not of 640 x 480: give the width, height and lens"
    ):
        VideoSource(cv2, path, REQUEST)


def test_what_is_no_video_is_named(tmp_path: Path) -> None:
    (tmp_path / "text.avi").write_text("no video")
    with pytest.raises(CameraError, match=r"text\.avi is not a video"):
        VideoSource(cv2, tmp_path / "text.avi", REQUEST)


def test_a_file_is_played_at_its_own_rate(tmp_path: Path) -> None:
    source = VideoSource(cv2, video(tmp_path / "slow.avi", rate=1.0), REQUEST)
    assert source.read(0.0) is not None
    assert source.read(0.01) is None, "the next image is due a second later"
    source.close()


def test_without_a_driver_the_device_does_nothing() -> None:
    robot = load_robot("chefbot_lidar")
    loop = Loop(WallClock(), time.time_ns())
    device = ColorCameraDevice(Context("camera", loop, robot, TransformBuffer()), NoParams())
    device.start()
    assert isinstance(device, CameraDevice) and device.announcement == "" != NO_DRIVER
    device.stop()
