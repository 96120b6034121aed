"""USB cameras among the video devices of a computer, and the sentence if the right one is not there."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from chefbot.devices.cameras.camera import CameraError
from chefbot.devices.cameras.v4l2 import (
    CAPABILITY,
    CAPTURES_VIDEO,
    VIDIOC_QUERYCAP,
    VideoDevice,
    camera_path,
    usb_cameras,
)

METADATA, OUTPUT = 0x00800000, 0x2
"""Bits of device_caps: of a camera's second device, and of a codec's input."""


def capability(card: str, bus: str, caps: int = CAPTURES_VIDEO) -> bytes:
    return CAPABILITY.pack(b"uvcvideo", card.encode(), bus.encode(), 0x060100, caps | 0x80000000, caps)


DEVICES = {
    "video10": capability("bcm2835-codec", "platform:bcm2835-codec", CAPTURES_VIDEO | OUTPUT),
    "video2": capability("C920", "usb-0000:01:00.0-1.2"),
    "video3": capability("C920", "usb-0000:01:00.0-1.2", METADATA),
    "video0": capability("unicam", "platform:3f801000.csi"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in (*DEVICES, "video1", "videos", "null"):
        (tmp_path / name).touch()
    return tmp_path


def read(path: Path) -> bytes:
    if path.name not in DEVICES:
        raise PermissionError(13, "Permission denied")
    return DEVICES[path.name]


def test_only_usb_cameras_that_capture_video_are_found(folder: Path) -> None:
    assert usb_cameras(folder, read) == [VideoDevice(folder / "video2", "C920")]


def test_files_that_are_no_video_devices_are_passed_over(folder: Path) -> None:
    assert usb_cameras(folder) == []  # the ioctl fails


def test_the_request_has_the_size_of_the_kernels_structure() -> None:
    direction, size, kind, number = (
        VIDIOC_QUERYCAP >> 30,
        VIDIOC_QUERYCAP >> 16 & 0x3FFF,
        *divmod(VIDIOC_QUERYCAP & 0xFFFF, 256),
    )
    assert (direction, size, chr(kind), number) == (2, CAPABILITY.size, "V", 0)


@pytest.mark.parametrize(
    ("cameras", "sentence"),
    [
        ([], "no USB camera is connected"),
        (["a", "b"], r"several USB cameras are connected \(a at /dev/a, b at /dev/b\): give sensors"),
    ],
)
def test_auto_needs_exactly_one_camera(cameras: list[str], sentence: str) -> None:
    with pytest.raises(CameraError, match=sentence):
        camera_path("auto", lambda: [VideoDevice(Path("/dev") / name, name) for name in cameras])


def test_a_given_camera_is_taken_if_it_is_there(tmp_path: Path) -> None:
    found = [VideoDevice(tmp_path / "video2", "C920")]
    os.mkfifo(tmp_path / "video2")
    assert camera_path("auto", lambda: found) == camera_path(str(tmp_path / "video2"), list) == found[0].path
    with pytest.raises(CameraError, match=rf"there is no camera /dev/nowhere \(C920 at {tmp_path}/video2\)"):
        camera_path("/dev/nowhere", lambda: found)
