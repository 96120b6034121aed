"""Layers of the web UI: how the payload of each is validated, copied, decimated and encoded."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.errors import UserError
from chefbot.maths.cell_grid import CellGrid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import MapEditResult
from chefbot.ros2.tools.inspection_views import GraphSummary, LogLine, NodeParameters, TopicValue
from chefbot.storage.delivery_history import RecordedRound
from chefbot.ui import protocol
from chefbot.ui.display.views import (
    CandidatesView,
    CauseView,
    CellView,
    DeliveryView,
    DepthView,
    FrameView,
    IncidentsView,
    LaunchView,
    MapBundleView,
    MappingView,
    PersonView,
    PlacedGrid,
    PlaybackView,
    ProgressView,
    RobotView,
    RoundStopView,
    ScanView,
    ShapeView,
    StatusView,
    StopView,
    ZoneView,
)
from chefbot.ui.image_encoding import encode_image, shown_image


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
    pinhole = {"focal": value.focal / step, "cx": value.cx / step, "cy": value.cy / step}
    return protocol.DepthImage(_millimetres(value.depth[::step, ::step]), pinhole, value.frame)


def _millimetres(depth: NDArray[Any]) -> NDArray[np.uint16]:
    """Return a depth image in mm, 0 for none: that of a camera as it is, that in metres converted (REP-118)."""
    if depth.dtype.kind == "u":
        return depth.astype("<u2")
    metres = np.where(np.isfinite(depth), np.clip(depth, 0.0, 65.0), 0.0)
    return np.rint(metres * 1000.0).astype("<u2")


def _grid(dtype: type[np.generic]) -> Callable[[Any], protocol.GridImage]:
    def take(grid: CellGrid) -> protocol.GridImage:
        if grid.cells.dtype != dtype or grid.cells.ndim != 2:
            raise TypeError(f"expected a grid of {dtype.__name__}, got {grid.cells.dtype} {grid.cells.shape}")
        return protocol.GridImage(grid.cells.copy(), grid.resolution, grid.origin_x, grid.origin_y)

    return take


def _placed_grid(value: PlacedGrid) -> protocol.GridImage:
    """Place a grid of costs in the map frame."""
    image, frame = _grid(np.uint8)(value.grid), value.frame
    corner = frame @ SE2(image.x, image.y, 0.0)
    return replace(image, x=round(corner.x, 3), y=round(corner.y, 3), yaw=round(frame.yaw, 4))


_ENCODE_JSON, _ENCODE_POINTS, _ENCODE_GRID = protocol.text, protocol.points, protocol.grid
FAST_PERIOD, SCAN_PERIOD, CAMERA_PERIOD, COSTMAP_PERIOD, MAP_PERIOD = 0.1, 0.2, 0.2, 0.5, 1.0
"""Minimum periods of the layers, s."""
MAX_CLOUD_WIDTH = 80
"""Points in a row of the depth camera's point cloud: 5 kB per frame."""

LAYERS: dict[str, Layer] = {
    "stop": Layer(0.0, _instance_of(StopView), _ENCODE_JSON),
    "map": Layer(MAP_PERIOD, _grid(np.int8), _ENCODE_GRID),
    "map_error": Layer(MAP_PERIOD, _grid(np.int8), _ENCODE_GRID),
    "costmap": Layer(COSTMAP_PERIOD, _grid(np.uint8), _ENCODE_GRID),
    "local_costmap": Layer(COSTMAP_PERIOD, _placed_grid, _ENCODE_GRID),
    "candidates": Layer(COSTMAP_PERIOD, _instance_of(CandidatesView), _ENCODE_JSON),
    "cell": Layer(0.0, _instance_of(CellView), _ENCODE_JSON),
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
    "edits": Layer(0.0, _tuple_of(MapEditResult), _ENCODE_JSON),
    "launch": Layer(FAST_PERIOD, _instance_of(LaunchView), _ENCODE_JSON),
    "mapping": Layer(FAST_PERIOD, _instance_of(MappingView), _ENCODE_JSON),
    "map_bundle": Layer(0.0, _instance_of(MapBundleView), _ENCODE_JSON),
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
    "parameters": Layer(FAST_PERIOD, _tuple_of(NodeParameters), _ENCODE_JSON),
    "log": Layer(MAP_PERIOD, _tuple_of(LogLine), _ENCODE_JSON),
    "incidents": Layer(FAST_PERIOD, _instance_of(IncidentsView), _ENCODE_JSON),
    "causes": Layer(FAST_PERIOD, _tuple_of(CauseView), _ENCODE_JSON),
    "playback": Layer(FAST_PERIOD, _instance_of(PlaybackView), _ENCODE_JSON),
    "progress": Layer(FAST_PERIOD, _instance_of(ProgressView), _ENCODE_JSON),
}
