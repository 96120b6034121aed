"""nav_msgs: odometry, occupancy grids, paths, and the services of a map server."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TwistWithCovariance,
)
from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Bool, Float32, Int8Array, Message, String, Uint8, Uint32
from chefbot.msgs.idl.service import define_service
from chefbot.msgs.std_msgs import Header

MAX_CELLS = 100_000_000
"""Maximum number of cells of a map, the same as for a map file."""
MIN_RESOLUTION, MAX_RESOLUTION = 1e-3, 100.0
"""Bounds of a map's resolution, m per cell; inflation of a finer map would take too long."""
MAX_MAP_AREA = 500_000.0
"""Maximum area of a map, m^2: localization keeps a likelihood field of it."""
MAX_CELLS_PER_RESOLUTION = 5e8
"""Maximum number of cells divided by the resolution, 1/m: the work of inflation and of a likelihood field, which
reach over metres, is proportional to it. At 5 cm it allows 250 m by 250 m, which takes about a second."""
MAX_PATH_LENGTH = 10_000.0
"""Maximum length of a path, m; a controller samples it every centimetre."""
MAX_POSES = 100_000
_NO_CELLS = np.empty(0, np.int8)


def map_cells(grid: Any) -> str:
    """Require that the map's size fits its data and the limits, and that each cell is -1 or 0 to 100."""
    info, n = grid.info, len(grid.data)
    if not 0 < info.width * info.height <= MAX_CELLS:
        return f"info: a map of {info.width} x {info.height} cells cannot be used"
    area = info.width * info.height * info.resolution**2
    if area > MAX_MAP_AREA:
        return f"info: the map covers {area:.6g} square metres, at most {MAX_MAP_AREA:g} can be used"
    if info.width * info.height > MAX_CELLS_PER_RESOLUTION * info.resolution:
        return f"info: {info.width} x {info.height} cells of {info.resolution:g} m take too long; use larger cells"
    if n != info.width * info.height:
        return f"data has {n} cells, but the map has {info.width} x {info.height}"
    return cell_values(grid.data)


def cell_values(data: NDArray[np.int8]) -> str:
    """Require that each cell is -1 or 0 to 100."""
    if len(data) and (data.min() < -1 or data.max() > 100):
        return "data holds cells that are neither -1 (unknown) nor 0 to 100 percent"
    return ""


def path_length(path: Any) -> str:
    """Require that the path is not longer than MAX_PATH_LENGTH."""
    points = np.array([(p.pose.position.x, p.pose.position.y) for p in path.poses]).reshape(-1, 2)
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    if length > MAX_PATH_LENGTH:
        return f"poses lead over {length:.6g} m, at most {MAX_PATH_LENGTH:g} can be driven"
    return ""


class Odometry(Message, frozen=True, eq=False):
    """An odometry estimate: pose in `header.frame_id`, twist in `child_frame_id`."""

    header: Header = Header()
    child_frame_id: String = ""
    pose: PoseWithCovariance = PoseWithCovariance()
    twist: TwistWithCovariance = TwistWithCovariance()


class MapMetaData(Message, frozen=True, eq=False):
    """Size, resolution (m per cell) and origin of an occupancy grid."""

    BOUNDS = per_field(resolution=(MIN_RESOLUTION, MAX_RESOLUTION))

    map_load_time: Time = Time()
    resolution: Float32 = 0.0
    width: Uint32 = 0
    height: Uint32 = 0
    origin: Pose = Pose()


class OccupancyGrid(Message, frozen=True, eq=False):
    """An occupancy grid, row-major from the lowest y; -1 unknown, 0 to 100 percent occupied."""

    MAX_LENGTHS = per_field(data=MAX_CELLS)
    RULES = (map_cells,)

    header: Header = Header()
    info: MapMetaData = MapMetaData()
    data: Int8Array = _NO_CELLS

    @property
    def grid(self) -> Grid:
        """The map as the `Grid` that the algorithms use."""
        origin = self.info.origin.position
        cells = np.asarray(self.data, np.int8).reshape(self.info.height, self.info.width)
        # the resolution is a float32: round it to the decimal that was set, such as 0.05
        return Grid(cells, round(float(self.info.resolution), 6), origin.x, origin.y)

    @staticmethod
    def of(header: Header, grid: Grid) -> OccupancyGrid:
        """Create the message from a grid."""
        origin = Pose(Point(grid.origin_x, grid.origin_y, 0.0))
        info = MapMetaData(header.stamp, grid.resolution, grid.width, grid.height, origin)
        return OccupancyGrid(header, info, grid.cells.reshape(-1))


class Path(Message, frozen=True, eq=False):
    """A path as poses in order."""

    MAX_LENGTHS = per_field(poses=MAX_POSES)
    RULES = (path_length,)

    header: Header = Header()
    poses: tuple[PoseStamped, ...] = ()

    @property
    def array(self) -> NDArray[np.float64]:
        """The poses as an array (n, 3) of x, y (m) and yaw (rad)."""
        return np.array([pose.pose.se2 for pose in self.poses], np.float64).reshape(-1, 3)

    @staticmethod
    def of(header: Header, poses: NDArray[np.float64]) -> Path:
        """Create the message from poses (n, 3), each with the path's header."""
        return Path(header, tuple(PoseStamped(header, Pose.of(SE2.of(pose))) for pose in poses))


class Goals(Message, frozen=True, eq=False):
    """Poses to navigate through, in order."""

    MAX_LENGTHS = per_field(goals=MAX_POSES)

    header: Header = Header()
    goals: tuple[PoseStamped, ...] = ()


class GetMap_Request(Message, frozen=True, eq=False):
    """A request for the current map."""

    structure_needs_at_least_one_member: Uint8 = 0


class GetMap_Response(Message, frozen=True, eq=False):
    """The current map of the map server."""

    map: OccupancyGrid = OccupancyGrid()


class LoadMap_Request(Message, frozen=True, eq=False):
    """A request to load a map from a file or URL."""

    map_url: String = ""


class LoadMap_Response(Message, frozen=True, eq=False):
    """The loaded map, or an error.

    `result` is 0 on success, 1 if there is no such map, 2 for bad data, 3 for bad metadata, 255 for other
    failures.
    """

    map: OccupancyGrid = OccupancyGrid()
    result: Uint8 = 0


class GetPlan_Request(Message, frozen=True, eq=False):
    """A request to plan a path between two poses."""

    start: PoseStamped = PoseStamped()
    goal: PoseStamped = PoseStamped()
    tolerance: Float32 = 0.0


class GetPlan_Response(Message, frozen=True, eq=False):
    """The path that was planned."""

    plan: Path = Path()


class SetMap_Request(Message, frozen=True, eq=False):
    """A request to replace the map and set the initial pose on it."""

    map: OccupancyGrid = OccupancyGrid()
    initial_pose: PoseWithCovarianceStamped = PoseWithCovarianceStamped()


class SetMap_Response(Message, frozen=True, eq=False):
    """Whether the map was accepted."""

    success: Bool = False


GetMap = define_service(GetMap_Request, GetMap_Response)
LoadMap = define_service(LoadMap_Request, LoadMap_Response)
GetPlan = define_service(GetPlan_Request, GetPlan_Response)
SetMap = define_service(SetMap_Request, SetMap_Response)
