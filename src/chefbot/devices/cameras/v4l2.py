"""USB cameras of Linux: which video devices there are, by the ioctl VIDIOC_QUERYCAP of V4L2.

Linux kernel documentation, "Video for Linux API", ioctl VIDIOC_QUERYCAP.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from chefbot.devices.cameras.camera import CameraError
from chefbot.robot.sensors import AUTO

VIDIOC_QUERYCAP = 0x80685600
"""Request number: reads a v4l2_capability, 104 bytes, of type 'V', number 0."""
CAPABILITY = struct.Struct("=16s32s32sIII12x")
"""v4l2_capability: driver, card, bus_info, version, capabilities, device_caps, and 12 reserved bytes."""
CAPTURES_VIDEO = 0x1
"""Bit of device_caps; a camera's second device, for metadata, does not have it."""
USB_BUS = "usb-"
"""Beginning of bus_info of USB cameras; codecs and CSI cameras of a Raspberry Pi have others."""
DEVICES = Path("/dev")


class VideoDevice(NamedTuple):
    """A device file that captures video, and the name of its camera."""

    path: Path
    name: str


def usb_cameras(folder: Path = DEVICES, read: Callable[[Path], bytes] | None = None) -> list[VideoDevice]:
    """Return the USB cameras in order of their device files; read: returns the v4l2_capability of a device."""
    return list(_usb_cameras(folder, read or _read_capability))


def _usb_cameras(folder: Path, read: Callable[[Path], bytes]) -> Iterator[VideoDevice]:
    paths = [path for path in folder.glob("video*") if path.name[5:].isdecimal()]
    for path in sorted(paths, key=lambda path: int(path.name[5:])):
        with suppress(OSError):  # it is being plugged in or out, or is nobody's to read
            _, card, bus, _, _, capabilities = CAPABILITY.unpack(read(path))
            if capabilities & CAPTURES_VIDEO and _text(bus).startswith(USB_BUS):
                yield VideoDevice(path, _text(card))


def _read_capability(path: Path) -> bytes:
    import fcntl  # Linux has it, and only there are such devices

    handle = os.open(path, os.O_RDWR | os.O_NONBLOCK)
    try:
        return fcntl.ioctl(handle, VIDIOC_QUERYCAP, bytes(CAPABILITY.size))
    finally:
        os.close(handle)


def _text(field: bytes) -> str:
    return field.partition(b"\0")[0].decode(errors="replace")


def camera_path(device: str, found: Callable[[], list[VideoDevice]] = usb_cameras) -> Path:
    """Return the path of a camera or video file; auto: of the only USB camera.

    CameraError if it is not there, or if there are several.
    """
    if device != AUTO:
        path = Path(device).expanduser()
        if path.exists():
            return path
        raise CameraError(f"there is no camera {device}{_listed(found())}")
    cameras = found()
    if not cameras:
        raise CameraError("no USB camera is connected, or none may be read (is the user in the group video?)")
    if len(cameras) > 1:
        raise CameraError(
            f"several USB cameras are connected{_listed(cameras)}: give sensors.color_camera.device"
        )
    return cameras[0].path


def _listed(cameras: list[VideoDevice]) -> str:
    names = ", ".join(f"{one.name} at {one.path}" for one in cameras)
    return f" ({names})" if names else ""
