"""Layers of the web UI: the payload of each, and how it is validated, copied, decimated and encoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.incidents.files import SavedIncident
from chefbot.maths.cell_grid import CellGrid
from chefbot.msgs.chefbot_msgs import MapEditResult
from chefbot.ros2.tools.inspection_views import GraphSummary, TopicValue
from chefbot.storage.delivery_history import RecordedRound
from chefbot.ui import protocol
from chefbot.ui.image_encoding import encode_image, shown_image


class RobotView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Estimated pose of the robot in the map frame (m, rad) and its velocity (m/s, rad/s)."""

    x: float
    y: float
    yaw: float
    v: float = 0.0
    w: float = 0.0


class ViewCone(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a sensor sees seen from above: its pose in base_link (m, rad), field of view (rad) and range (m)."""

    x: float
    y: float
    yaw: float
    field_of_view: float
    range: float


class ShapeView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The robot seen from above in base_link, m: circumscribed radius, footprint, wheels and sensors."""

    radius: float
    corners: tuple[tuple[float, float], ...]
    """Corners of the footprint; empty for a disc of `radius`."""
    wheels: tuple[tuple[float, float, float, float], ...]
    """Centre (x, y), length and width of each wheel."""
    cones: tuple[ViewCone, ...]
    """Sensors that do not see all around."""


@dataclass(frozen=True, eq=False)
class ScanView:
    """A laser scan: ranges (n,) in metres at angles (n,) in radians, from the sensor's pose (x, y, yaw)."""

    pose: Sequence[float]
    angles: NDArray[Any]
    ranges: NDArray[Any]
    frame: str = ""
    """Frame of the sensor, which gives its height above the floor."""

    def points(self) -> NDArray[np.float64]:
        """Return the end points of the finite beams, (m, 2), in the frame of the pose."""
        x, y, yaw = self.pose
        ranges = np.asarray(self.ranges, np.float64)
        bearing = np.asarray(self.angles, np.float64) + yaw
        ends = np.column_stack([x + ranges * np.cos(bearing), y + ranges * np.sin(bearing)])
        return ends[np.isfinite(ranges)]


class FrameView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A frame in its parent: translation in metres, rotation as a quaternion (x, y, z, w)."""

    name: str
    parent: str
    at: tuple[float, float, float]
    turn: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class DepthView:
    """A depth image (h, w) in metres along the optical axis, NaN for none; camera intrinsics in pixels; the
    optical frame."""

    depth: NDArray[Any]
    focal: float
    cx: float
    cy: float
    frame: str


class PersonView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A tracked person in the map frame: number, position (m), velocity (m/s), standard deviation of the position
    (m), and whether it was seen just now."""

    id: int
    x: float
    y: float
    vx: float
    vy: float
    deviation: float
    visible: bool


class ZoneView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A zone of the map: its title, its kind as in chefbot_msgs/MapZone, its corners (m) in the map frame, the
    direction of a one-way lane (rad) and the limit of a slow zone (m/s)."""

    title: str
    name: str
    kind: str
    corners: tuple[tuple[float, float], ...]
    direction: float
    speed: float


class DoorView(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A door of the simulated world; `open` is false only when it is fully closed."""

    name: str
    open: bool


def rounded(number: float | None, digits: int) -> float | None:
    """Return a number as it is displayed: changes that nobody sees are not sent."""
    return None if number is None else round(float(number), digits)


class StatusView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The robot's state as texts and numbers; None is unknown and shows as a dash."""

    phase: str = ""
    """Current activity, one sentence."""
    clock: float | None = None
    """Time since the start on the robot's clock, s."""
    real_time_factor: float | None = None
    battery: float | None = None
    """Battery charge, percent, 0..100."""
    volts: float | None = None
    confidence: float | None = None
    """Confidence of the localization, 0..1."""
    localization_error: float | None = None
    """Distance between estimate and ground truth, m; simulation only."""
    navigation: str = ""
    """State of the navigator, one or two words."""
    reason: str = ""
    """Why it stopped or slowed down the last time, one sentence."""
    stopped: bool = False
    """Whether the emergency stop is latched."""
    stop_pending: bool = False
    """Whether the emergency stop was pressed here and is not confirmed by the robot yet."""
    simulation: bool = False
    """Whether the web UI may offer boxes, doors and kidnapping."""
    warnings: tuple[str, ...] = ()
    """Diagnostics that are not OK, one sentence each."""
    failures: int = 0
    """Number of failed goals; `reason` is that of the last."""
    doors: tuple[DoorView, ...] = ()
    """Doors that the simulation can move."""


class StopView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """State of the emergency stop in the drive base; sent before all other layers."""

    stopped: bool = False
    """Whether the emergency stop is latched."""
    requested: bool = False
    """Whether a press waits for confirmation by the drive base."""
    confirmed: tuple[str, ...] = ()
    """Ids of the newest presses that the drive base has confirmed."""
    pressed: str = ""
    """Time of the last press, nanoseconds, as text: JavaScript's numbers have too few digits."""


class DeliveryView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The delivery mission: tables still to serve, the current step as a sentence, and what a person has to
    confirm."""

    queue: tuple[str, ...] = ()
    order_id: str = ""
    step: str = ""
    state: str = ""
    """State of the mission as in chefbot_msgs/DeliveryStatus."""
    place: str = ""
    """Place where the robot is or to which it drives."""
    waits_for: str = ""
    """What a person has to confirm: loaded, taken, choice, or nothing."""
    choices: tuple[str, ...] = ()
    """Possible choices now, of go_on, kitchen and end."""
    round_active: bool = False
    """Whether a round is active; a goal elsewhere must then contain `when`."""
    loaded: bool = False
    """Whether the food is on the tray."""
    errands: tuple[str, ...] = ()
    """Names of additional goals."""
    delivered: tuple[str, ...] = ()
    """Tables of this order that were served."""
    missed: tuple[str, ...] = ()
    """Why tables of this order were not served, a sentence each."""
    unserved: tuple[str, ...] = ()
    """Tables of the last order that were not served and are not ordered again."""
    orders: tuple[tuple[str, ...], ...] = ()
    """Tables of the queued orders."""


class RoundStopView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A stop that is left of a round: way to it (m), time until the arrival (s), charge then (percent)."""

    place: str
    distance: float
    time: float
    battery: float | None


class CauseView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Why the robot slowed down, stopped, took a detour or failed; see chefbot_msgs/Cause."""

    id: int
    time: float
    """When it began on the robot's clock, s."""
    ended: float | None
    """When it ended, s; None while it holds."""
    effect: str
    """Slower, Stopped, Detour or Failed."""
    sentence: str
    chain: tuple[str, ...] = ()
    x: float | None = None
    y: float | None = None
    """Where the obstacle is on the map, m; None if there is none or it is not known."""
    number: int = 0
    """Its number in the history of the robot, 0 if it is not recorded."""
    pictures: tuple[str, ...] = ()
    """Pictures at `causes/NUMBER/PICTURE`: map, camera."""
    began: str = ""
    """When it began, UTC in ISO 8601, in an earlier run; then `time` is 0, and `ended` how long it lasted."""


class IncidentsView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The newest incidents, and how the last request to save one ended; `requests` counts those that have ended."""

    saved: tuple[SavedIncident, ...] = ()
    outcome: str = ""
    requests: int = 0


class PlaybackView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Position in a recording that is played, and its length, s; `rate` 0 is a pause."""

    time: float
    length: float
    rate: float
    title: str


class ProgressView(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Progress of a long job such as 'compiling kernels': `done` of `total`."""

    text: str
    done: int
    total: int


class Layer(NamedTuple):
    """A layer: `take` (validate, copy) runs in the caller's thread, `encode` in the server's; minimum
    `period` in seconds."""

    period: float
    validate: Callable[[Any], Any]
    encode: Callable[[str, Any], protocol.Frame]


def _instance_of(kind: type[msgspec.Struct]) -> Callable[[Any], Any]:
    def take(value: Any) -> Any:
        if not isinstance(value, kind):
            raise TypeError(f"expected {kind.__name__}, got {type(value).__name__}")
        return value

    return take


def _tuple_of(kind: type[msgspec.Struct]) -> Callable[[Any], Any]:
    take = _instance_of(kind)
    return lambda values: tuple(take(value) for value in values)


def _pose(value: Sequence[float]) -> dict[str, float]:
    x, y, yaw = (float(component) for component in value)
    if not np.isfinite([x, y, yaw]).all():
        raise ValueError(f"a pose must be finite, got {(x, y, yaw)}")
    return {"x": round(x, 3), "y": round(y, 3), "yaw": round(yaw, 3)}


def _places(value: Mapping[str, Sequence[float]]) -> list[dict[str, Any]]:
    return [{"name": str(name), **_pose(pose)} for name, pose in value.items()]


def _labels(value: Mapping[str, str]) -> dict[str, str]:
    return {str(name): str(label) for name, label in value.items()}


def _points(columns: int) -> Callable[[Any], NDArray[np.float64]]:
    def take(value: Any) -> NDArray[np.float64]:
        points = value.points() if isinstance(value, ScanView) else np.array(value, np.float64)
        if points.size == 0:
            return np.zeros((0, columns))
        if points.ndim != 2 or points.shape[1] < columns:
            raise ValueError(f"expected points (n, {columns}), got shape {points.shape}")
        points = points[:, :columns]
        return points[np.isfinite(points).all(axis=1)]

    return take


def _scan(value: ScanView) -> tuple[NDArray[np.float64], str]:
    if not isinstance(value, ScanView):
        raise TypeError(f"expected Scan, got {type(value).__name__}")
    return _points(2)(value), value.frame


def _encode_scan(layer: str, value: tuple[NDArray[np.float64], str]) -> bytes:
    return protocol.points(layer, *value)


def _joints(value: Mapping[str, float]) -> dict[str, float]:
    return {str(name): float(position) for name, position in value.items()}


def _text(value: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected a text, got {type(value).__name__}")
    return value


def _depth(value: DepthView) -> protocol.DepthImage:
    """Decimate the image and convert it to millimetres: an operator sees no more of a point cloud."""
    if not isinstance(value, DepthView):
        raise TypeError("expected DepthView")
    if value.depth.ndim != 2 or value.depth.size == 0:
        raise UserError(f"a depth image of shape {value.depth.shape} cannot be shown, one of (h, w) can")
    # Decimate to at most MAX_CLOUD_WIDTH columns; the intrinsics scale with the image.
    step = -(-value.depth.shape[1] // MAX_CLOUD_WIDTH)
    metres = value.depth[::step, ::step]
    millimetres = np.where(np.isfinite(metres), np.clip(metres, 0.0, 65.0), 0.0) * 1000.0
    pinhole = {"focal": value.focal / step, "cx": value.cx / step, "cy": value.cy / step}
    return protocol.DepthImage(np.rint(millimetres).astype("<u2"), pinhole, value.frame)


def _grid(dtype: type[np.generic]) -> Callable[[Any], protocol.GridImage]:
    def take(grid: CellGrid) -> protocol.GridImage:
        if grid.cells.dtype != dtype or grid.cells.ndim != 2:
            raise TypeError(f"expected a grid of {dtype.__name__}, got {grid.cells.dtype} {grid.cells.shape}")
        return protocol.GridImage(grid.cells.copy(), grid.resolution, grid.origin_x, grid.origin_y)

    return take


_ENCODE_JSON, _ENCODE_POINTS, _ENCODE_GRID = protocol.text, protocol.points, protocol.grid
FAST_PERIOD, SCAN_PERIOD, CAMERA_PERIOD, COSTMAP_PERIOD, MAP_PERIOD = 0.1, 0.2, 0.2, 0.5, 1.0
"""Minimum periods of the layers, s."""
MAX_CLOUD_WIDTH = 80
"""Points in a row of the depth camera's point cloud: 5 kB per frame."""

LAYERS: dict[str, Layer] = {
    "stop": Layer(0.0, _instance_of(StopView), _ENCODE_JSON),
    "map": Layer(MAP_PERIOD, _grid(np.int8), _ENCODE_GRID),
    "costmap": Layer(COSTMAP_PERIOD, _grid(np.uint8), _ENCODE_GRID),
    "shape": Layer(0.0, _instance_of(ShapeView), _ENCODE_JSON),
    "robot": Layer(FAST_PERIOD, _instance_of(RobotView), _ENCODE_JSON),
    "truth": Layer(FAST_PERIOD, _pose, _ENCODE_JSON),
    "scan": Layer(SCAN_PERIOD, _scan, _encode_scan),
    "obstacles": Layer(SCAN_PERIOD, _scan, _encode_scan),
    "particles": Layer(FAST_PERIOD, _points(3), _ENCODE_POINTS),
    "path": Layer(FAST_PERIOD, _points(2), _ENCODE_POINTS),
    "local_path": Layer(FAST_PERIOD, _points(2), _ENCODE_POINTS),
    "goal": Layer(FAST_PERIOD, _pose, _ENCODE_JSON),
    "people": Layer(FAST_PERIOD, _tuple_of(PersonView), _ENCODE_JSON),
    "camera": Layer(CAMERA_PERIOD, shown_image, encode_image),
    "status": Layer(FAST_PERIOD, _instance_of(StatusView), _ENCODE_JSON),
    "places": Layer(FAST_PERIOD, _places, _ENCODE_JSON),
    "labels": Layer(FAST_PERIOD, _labels, _ENCODE_JSON),
    "edit": Layer(0.0, _instance_of(MapEditResult), _ENCODE_JSON),
    "zones": Layer(MAP_PERIOD, _tuple_of(ZoneView), _ENCODE_JSON),
    "delivery": Layer(FAST_PERIOD, _instance_of(DeliveryView), _ENCODE_JSON),
    "forecast": Layer(FAST_PERIOD, _tuple_of(RoundStopView), _ENCODE_JSON),
    "history": Layer(FAST_PERIOD, _tuple_of(RecordedRound), _ENCODE_JSON),
    "frames": Layer(FAST_PERIOD, _tuple_of(FrameView), _ENCODE_JSON),
    "fixed_frames": Layer(MAP_PERIOD, _tuple_of(FrameView), _ENCODE_JSON),
    "joints": Layer(FAST_PERIOD, _joints, _ENCODE_JSON),
    "description": Layer(MAP_PERIOD, _text, _ENCODE_JSON),
    "depth": Layer(CAMERA_PERIOD, _depth, protocol.depth),
    "graph": Layer(MAP_PERIOD, _instance_of(GraphSummary), _ENCODE_JSON),
    "values": Layer(FAST_PERIOD, _tuple_of(TopicValue), _ENCODE_JSON),
    "incidents": Layer(FAST_PERIOD, _instance_of(IncidentsView), _ENCODE_JSON),
    "causes": Layer(FAST_PERIOD, _tuple_of(CauseView), _ENCODE_JSON),
    "playback": Layer(FAST_PERIOD, _instance_of(PlaybackView), _ENCODE_JSON),
    "progress": Layer(FAST_PERIOD, _instance_of(ProgressView), _ENCODE_JSON),
}
