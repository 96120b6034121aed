"""What a camera gives, whatever its maker, and the modules that open each kind of depth camera."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ChefbotError, UserError
from chefbot.robot.sensors import AUTO
from chefbot.runtime.clock import wall_ns

MILLIMETRE = 1e-3
"""Unit of depth in an image of encoding 16UC1, m (REP-118)."""
MAX_DEPTH = 65535
"""Largest value of a pixel."""
MAX_AGE_NS = 500_000_000
"""Age of an image above which its time stamp is not believed, ns."""


class CameraError(ChefbotError):
    """A camera that is not there, or has failed, with the reason as a phrase."""


class TimedImage(Protocol):
    """An image of a camera."""

    @property
    def taken_ns(self) -> int:
        """Monotonic clock at its exposure, ns."""


I_co = TypeVar("I_co", bound=TimedImage, covariant=True)


class StreamRequest(NamedTuple):
    """What a robot file asks of its camera: serial number or device file, or auto, size in pixels, and rate in Hz."""

    serial: str
    width: int
    height: int
    rate: float


class StreamMode(NamedTuple):
    """A depth stream that a camera offers: size in pixels, and rate in Hz."""

    width: int
    height: int
    rate: float


class Intrinsics(NamedTuple):
    """Focal lengths and principal point of an undistorted image, pixels."""

    fx: float
    fy: float
    cx: float
    cy: float


class CameraFrame(NamedTuple):
    """One depth image, its intrinsics, and its time.

    depth: (h, w) mm along the optical axis, 0 for no reading. taken_ns: monotonic clock at its exposure, ns.
    """

    depth: NDArray[np.uint16]
    intrinsics: Intrinsics
    taken_ns: int


class OpenCamera(Protocol[I_co]):
    """A camera that sends images; `read` and `close` are called by one thread."""

    @property
    def name(self) -> str:
        """Model and serial number of the camera."""

    def read(self, timeout: float) -> I_co | None:
        """Return the next image, or None after `timeout` seconds. CameraError if the camera is gone."""

    def close(self) -> None:
        """Stop the stream and release the camera."""


CameraOpener = Callable[[StreamRequest], OpenCamera[CameraFrame]]
"""Opens a depth camera and starts its stream. CameraError if that fails."""


def opener_of(driver: str) -> CameraOpener:
    """Return how a kind of camera is opened. UserError if the SDK of its maker is not installed."""
    try:
        if driver == "realsense":
            from chefbot.devices.cameras.realsense import open_realsense as opener
        elif driver == "oak":
            from chefbot.devices.cameras.oak import open_oak as opener
        else:
            from chefbot.devices.cameras.orbbec import open_orbbec as opener
    except ImportError as error:
        raise UserError(
            f"sensors.depth_camera.driver: {driver} needs the SDK of its maker, which cannot be imported ({error});"
            f" install it: pip install 'chefbot[{driver}]'"
        ) from error
    return opener


def selected(found: list[str], serial: str, maker: str) -> str:
    """Return the serial number of the camera to open. CameraError if it is not there, or there are several."""
    if serial != AUTO:
        if serial not in found:
            listed = f"; connected: {', '.join(found)}" if found else ""
            raise CameraError(f"no {maker} camera with serial number {serial} is connected{listed}")
        return serial
    if not found:
        raise CameraError(f"no {maker} camera is connected")
    if len(found) > 1:
        raise CameraError(
            f"several {maker} cameras are connected ({', '.join(found)}): give sensors.depth_camera.serial"
        )
    return found[0]


def best_mode(modes: list[StreamMode], request: StreamRequest) -> int:
    """Return the index of the smallest mode that has the size and rate requested, else of the nearest one.

    A smaller image or rate than requested is worse than a larger one; CameraError without any mode.
    """
    if not modes:
        raise CameraError("the camera offers no depth images")

    def cost(index: int) -> tuple[float, float, float]:
        mode = modes[index]
        missing_rate = max(0.0, request.rate - mode.rate) / request.rate
        missing_size = max(0.0, 1.0 - mode.width * mode.height / (request.width * request.height))
        return (missing_rate + missing_size, float(mode.width * mode.height), mode.rate)

    return min(range(len(modes)), key=cost)


def to_millimetres(pixels: NDArray[np.uint16], unit: float) -> NDArray[np.uint16]:
    """Return depths (h, w) in mm; unit: metres per unit of `pixels`. What does not fit is 0, no reading."""
    if abs(unit - MILLIMETRE) < 1e-9:
        return pixels.copy()  # the SDK uses its memory again
    scaled = np.rint(pixels * np.float32(unit / MILLIMETRE))
    return np.where(scaled <= MAX_DEPTH, scaled, 0).astype(np.uint16)


def monotonic_ns(stamp_ns: int) -> int:
    """Return a time stamp of the system clock, ns since 1970, on the monotonic clock; now, if it cannot be right."""
    now_ns, age_ns = wall_ns(), time.time_ns() - stamp_ns
    return now_ns - age_ns if 0 <= age_ns <= MAX_AGE_NS else now_ns
