"""What the page can show: the payload of each layer, and how it is copied, thinned out and encoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.ui import wire
from chefbot.ui.picture import jpeg


class GridLike(Protocol):
    """`chefbot.maths.grid.Grid`, or a costmap with uint8 cells; rows go up in y."""

    @property
    def cells(self) -> NDArray[Any]:
        """(height, width)."""

    @property
    def resolution(self) -> float:
        """Metres per cell."""

    @property
    def origin_x(self) -> float:
        """Metres, outer corner of cell [0, 0] in the map frame."""

    @property
    def origin_y(self) -> float:
        """Metres."""


class RobotView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the robot thinks it is, in the map frame, its radius and its speed (m, rad, m/s, rad/s)."""

    x: float
    y: float
    yaw: float
    radius: float
    v: float = 0.0
    w: float = 0.0


@dataclass(frozen=True, eq=False)
class Scan:
    """A laser scan: ranges (n,) in metres at angles (n,) in radians, from the sensor's pose (x, y, yaw)."""

    pose: Sequence[float]
    angles: NDArray[Any]
    ranges: NDArray[Any]
    frame: str = ""
    """The sensor's: what is above the floor knows its height from it."""

    def points(self) -> NDArray[np.float64]:
        """The end points of the finite beams in the frame of the pose, (m, 2)."""
        x, y, yaw = self.pose
        ranges = np.asarray(self.ranges, np.float64)
        bearing = np.asarray(self.angles, np.float64) + yaw
        ends = np.column_stack([x + ranges * np.cos(bearing), y + ranges * np.sin(bearing)])
        return ends[np.isfinite(ranges)]


class FrameView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A frame in its parent: place in metres, attitude as a quaternion (x, y, z, w)."""

    name: str
    parent: str
    at: tuple[float, float, float]
    turn: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class DepthView:
    """Depth (h, w) in metres along the optical axis, NaN for none; the pinhole in pixels; the optical frame."""

    depth: NDArray[Any]
    focal: float
    cx: float
    cy: float
    frame: str


class Status(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The state of the whole in words and numbers; None is 'not known' and shows as a dash."""

    phase: str = ""
    """One sentence: what goes on now."""
    clock: float | None = None
    """Seconds since the start, of the robot's clock."""
    real_time_factor: float | None = None
    battery: float | None = None
    """Percent, 0..100."""
    volts: float | None = None
    confidence: float | None = None
    """Of the localization, 0..1."""
    localization_error: float | None = None
    """Metres between the estimate and the truth; simulation only."""
    navigation: str = ""
    """State of the navigator in a word or two."""
    reason: str = ""
    """Why it stopped or slowed down the last time, one sentence."""
    stopped: bool = False
    """Whether an operator's STOP is latched."""
    stop_asked: bool = False
    """Whether STOP was pressed here and is not confirmed by the robot yet."""
    simulation: bool = False
    """Whether the page may offer boxes, doors and kidnapping."""
    warnings: tuple[str, ...] = ()
    """What is wrong with which part, a sentence each."""
    failures: int = 0
    """How many goals were given up; `reason` is of the last."""
    doors: tuple[str, ...] = ()
    """Doors that the simulation can move."""


class StopView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """STOP as the base has it; sent before all other layers."""

    stopped: bool = False
    """Whether it is latched."""
    asked: bool = False
    """Whether a press waits for the base to confirm it."""
    confirmed: tuple[str, ...] = ()
    """The newest presses that the base has latched, by their id."""
    pressed: str = ""
    """When it was pressed last, nanoseconds as a text: JavaScript's numbers are too short."""


class Delivery(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The deliveries: tables still to serve, the step in words, and what a person has to press."""

    queue: tuple[str, ...] = ()
    step: str = ""
    state: str = ""
    """As in chefbot_msgs/DeliveryStatus."""
    place: str = ""
    """Where it is or drives to."""
    waits_for: str = ""
    """What a person has to press: loaded, taken, choice, or nothing."""
    choices: tuple[str, ...] = ()
    """Of go_on, kitchen and end, what is possible now."""
    in_hand: bool = False
    """Whether there is a round; a drive elsewhere then has to say when."""
    errands: tuple[str, ...] = ()
    """Where it is sent besides."""
    delivered: tuple[str, ...] = ()
    """Tables of this order that were served."""
    missed: tuple[str, ...] = ()
    """Of this order: why a table was not served, a sentence each."""
    orders: tuple[tuple[str, ...], ...] = ()
    """Tables of the orders that wait for this one."""


class Progress(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A long job such as 'compiling kernels': `done` of `total`."""

    text: str
    done: int
    total: int


class Layer(NamedTuple):
    """`take` (check, copy) runs in the caller's thread, `encode` in the page's; `period` in seconds."""

    period: float
    take: Callable[[Any], Any]
    encode: Callable[[str, Any], wire.Frame]


def _struct(kind: type[msgspec.Struct]) -> Callable[[Any], Any]:
    def take(value: Any) -> Any:
        if not isinstance(value, kind):
            raise TypeError(f"expected {kind.__name__}, got {type(value).__name__}")
        return value

    return take


def _pose(value: Sequence[float]) -> dict[str, float]:
    x, y, yaw = (float(number) for number in value)
    if not np.isfinite([x, y, yaw]).all():
        raise ValueError(f"a pose must be finite, got {(x, y, yaw)}")
    return {"x": x, "y": y, "yaw": yaw}


def _places(value: Mapping[str, Sequence[float]]) -> list[dict[str, Any]]:
    return [{"name": str(name), **_pose(pose)} for name, pose in value.items()]


def _points(columns: int) -> Callable[[Any], NDArray[np.float64]]:
    def take(value: Any) -> NDArray[np.float64]:
        points = value.points() if isinstance(value, Scan) else np.array(value, np.float64)
        if points.size == 0:
            return np.zeros((0, columns))
        if points.ndim != 2 or points.shape[1] < columns:
            raise ValueError(f"expected points (n, {columns}), got shape {points.shape}")
        points = points[:, :columns]
        return points[np.isfinite(points).all(axis=1)]

    return take


def _scan(value: Scan) -> tuple[NDArray[np.float64], str]:
    if not isinstance(value, Scan):
        raise TypeError(f"expected Scan, got {type(value).__name__}")
    return _points(2)(value), value.frame


def _encode_scan(layer: str, value: tuple[NDArray[np.float64], str]) -> bytes:
    return wire.points(layer, *value)


def _frames(value: Sequence[FrameView]) -> tuple[FrameView, ...]:
    return tuple(_struct(FrameView)(frame) for frame in value)


def _joints(value: Mapping[str, float]) -> dict[str, float]:
    return {str(name): float(position) for name, position in value.items()}


def _text(value: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected a text, got {type(value).__name__}")
    return value


def _depth(value: DepthView) -> wire.DepthImage:
    """Every so many-th pixel, in whole millimetres: an eye sees no more of a cloud of points."""
    if not isinstance(value, DepthView):
        raise TypeError("expected DepthView")
    if value.depth.ndim != 2 or value.depth.size == 0:
        raise UserError(f"a depth image of shape {value.depth.shape} cannot be shown, one of (h, w) can")
    step = -(-value.depth.shape[1] // CLOUD_WIDTH)
    metres = value.depth[::step, ::step]
    millimetres = np.where(np.isfinite(metres), np.clip(metres, 0.0, 65.0), 0.0) * 1000.0
    pinhole = {"focal": value.focal / step, "cx": value.cx / step, "cy": value.cy / step}
    return wire.DepthImage(np.rint(millimetres).astype("<u2"), pinhole, value.frame)


def _encode_depth(layer: str, image: wire.DepthImage) -> bytes:
    return wire.depth(layer, image)


def _grid(dtype: type[np.generic]) -> Callable[[Any], wire.GridImage]:
    def take(grid: GridLike) -> wire.GridImage:
        if grid.cells.dtype != dtype or grid.cells.ndim != 2:
            raise TypeError(f"expected a grid of {dtype.__name__}, got {grid.cells.dtype} {grid.cells.shape}")
        return wire.GridImage(grid.cells.copy(), grid.resolution, grid.origin_x, grid.origin_y)

    return take


def _image(value: NDArray[Any]) -> NDArray[Any]:
    rgb = value.dtype == np.uint8 and value.ndim == 3 and value.shape[2] == 3
    depth = value.dtype in (np.float32, np.float64, np.uint16) and value.ndim == 2
    if not (rgb or depth) or value.size == 0:
        raise TypeError(f"expected RGB uint8 (h, w, 3) or depth (h, w), got {value.dtype} {value.shape}")
    return value.copy()


def _encode_image(layer: str, image: NDArray[Any]) -> bytes:
    return wire.bulk(layer, {"kind": "jpeg"}, jpeg(image))


_JSON, _POINTS, _GRID = wire.text, wire.points, wire.grid
FAST, CAMERA, COSTMAP, MAP = 0.1, 0.2, 0.5, 1.0
CLOUD_WIDTH = 80
"""Points in a row of the depth camera's cloud: 5 kB a frame."""

LAYERS: dict[str, Layer] = {
    "stop": Layer(0.0, _struct(StopView), _JSON),
    "map": Layer(MAP, _grid(np.int8), _GRID),
    "costmap": Layer(COSTMAP, _grid(np.uint8), _GRID),
    "robot": Layer(FAST, _struct(RobotView), _JSON),
    "truth": Layer(FAST, _pose, _JSON),
    "scan": Layer(FAST, _scan, _encode_scan),
    "obstacles": Layer(FAST, _scan, _encode_scan),
    "particles": Layer(FAST, _points(3), _POINTS),
    "path": Layer(FAST, _points(2), _POINTS),
    "local_path": Layer(FAST, _points(2), _POINTS),
    "goal": Layer(FAST, _pose, _JSON),
    "camera": Layer(CAMERA, _image, _encode_image),
    "status": Layer(FAST, _struct(Status), _JSON),
    "places": Layer(FAST, _places, _JSON),
    "delivery": Layer(FAST, _struct(Delivery), _JSON),
    "frames": Layer(FAST, _frames, _JSON),
    "fixed_frames": Layer(MAP, _frames, _JSON),
    "joints": Layer(FAST, _joints, _JSON),
    "description": Layer(MAP, _text, _JSON),
    "depth": Layer(CAMERA, _depth, _encode_depth),
    "progress": Layer(FAST, _struct(Progress), _JSON),
}
