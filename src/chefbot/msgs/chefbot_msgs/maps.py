"""Messages of chefbot_msgs about maps: places and zones, changes, and the scans that a map is made of."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from chefbot.maths.lanes import MAX_LANES
from chefbot.msgs.geometry_msgs import Point, PoseStamped
from chefbot.msgs.idl.constraints import MAX_MAGNITUDE, min_length, per_field, same_length
from chefbot.msgs.idl.message import (
    Bool,
    Float32,
    Float32Array,
    Float64,
    Float64Array,
    Int8,
    Message,
    String,
    StringArray,
    Uint32,
)
from chefbot.msgs.sensor_msgs import DISTANCE, MAX_BEAMS
from chefbot.msgs.std_msgs import Header

MAX_PLACES = 1000
"""Maximum number of places of a map."""
MAX_STROKES, MAX_STROKE_POINTS = 1000, 10_000
"""Maximum number of strokes of a change of the map, and of points of a stroke."""
MAX_ZONES, MAX_CORNERS = 1000, 1000
"""Maximum number of zones of a map, and of corners of a zone."""
KEEP_OUT, SLOW_ZONE, PREFERRED, ONE_WAY = "keep_out", "slow", "preferred", "one_way"
"""Kinds of zones: no part of the robot enters; speed is limited; paths prefer it; driven in one direction only."""
ZONE_TITLES = {
    KEEP_OUT: "keep-out zone",
    SLOW_ZONE: "slow zone",
    PREFERRED: "preferred zone",
    ONE_WAY: "one-way lane",
}


MAX_MAPPER, MAX_TRAJECTORY = 10_000, 1_000_000
"""Maximum length of the description of a mapper, and number of poses of a trajectory."""
_NO_FLOATS, _NO_DOUBLES = np.empty(0, np.float32), np.empty(0, np.float64)
_ORIGIN = np.zeros(3)
_ORIGIN.flags.writeable = False
PlanarPose = Annotated[NDArray[np.float64], "float64[3]"]
"""x and y, m, and yaw, rad: exact, as a quaternion would not be."""


class MapZone(Message, frozen=True, eq=False):
    """An area of the map with a rule for the robot: a polygon in the frame of the message, m."""

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(speed=(0.0, MAX_MAGNITUDE), direction=(-MAX_MAGNITUDE, MAX_MAGNITUDE))
    MAX_LENGTHS = per_field(corners=MAX_CORNERS)
    RULES = (min_length(3, "corners"),)

    name: String = ""
    kind: String = ""
    """keep_out, slow, preferred, one_way"""
    corners: tuple[Point, ...] = ()
    speed: Float64 = 0.0
    """Maximum speed in a slow zone, m/s."""
    direction: Float64 = 0.0
    """Direction of a one-way lane, rad."""

    @property
    def title(self) -> str:
        """Kind and name in words, such as "keep-out zone stairs", or "keep-out zone 1" for keep_out_1."""
        name = self.name.removeprefix(f"{self.kind}_").replace("_", " ")
        return f"{ZONE_TITLES.get(self.kind, 'zone')} {name}"

    @property
    def array(self) -> NDArray[np.float64]:
        """The corners (n, 2), m."""
        return np.array([(corner.x, corner.y) for corner in self.corners]).reshape(-1, 2)


def _check_lanes(message: MapZones) -> str:
    count = len(message.of_kind(ONE_WAY))
    return "" if count <= MAX_LANES else f"zones holds {count} one-way lanes, at most {MAX_LANES} can be used"


class MapZones(Message, frozen=True, eq=False):
    """All zones of the map."""

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(zones=MAX_ZONES)
    RULES = (_check_lanes,)

    header: Header = Header()
    zones: tuple[MapZone, ...] = ()

    def of_kind(self, kind: str) -> tuple[MapZone, ...]:
        """Return the zones of a kind, in their order."""
        return tuple(zone for zone in self.zones if zone.kind == kind)


class Place(Message, frozen=True, eq=False):
    """A named pose on the map, and how exactly it has to be reached: m and rad, 0: as any other goal.

    People see `label` instead of the name, if it has one.
    """

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(xy_tolerance=(0.0, 1.0), yaw_tolerance=(0.0, 3.15))

    name: String = ""
    pose: PoseStamped = PoseStamped()
    xy_tolerance: Float64 = 0.0
    yaw_tolerance: Float64 = 0.0
    label: String = ""


class Places(Message, frozen=True, eq=False):
    """All named places on the map."""

    ROS_PACKAGE = "chefbot_msgs"

    places: tuple[Place, ...] = ()


class MapStroke(Message, frozen=True, eq=False):
    """A stroke of a brush on the map: along points (m), with a width (m); `value` is 100 wall, 0 free, -1 unknown."""

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(width=(0.0, 10.0), value=(-1, 100))
    MAX_LENGTHS = per_field(points=MAX_STROKE_POINTS)
    RULES = (min_length(1, "points"),)

    points: tuple[Point, ...] = ()
    width: Float64 = 0.0
    value: Int8 = 0


class MapEdit(Message, frozen=True, eq=False):
    """A change of the map, or of its places and zones, which replaces those of the same name.

    `strokes` are drawn on the map. `crop` has two opposite corners of the part that is left. `rotation` (rad) turns
    the map with its places and zones about the origin of its frame. With `new`, nothing is replaced: a name that is
    taken becomes the next free one. With `keep_poses`, places that exist stay where they are. With `undo`, the last
    change is taken back; with `preview`, only the result is published. With `seen_change`, the id of the last
    change that the editor knows, it is refused if another one has come since.
    """

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(
        **dict.fromkeys(("places", "deleted_places"), MAX_PLACES),
        **dict.fromkeys(("zones", "deleted_zones"), MAX_ZONES),
        strokes=MAX_STROKES,
        crop=2,
    )
    BOUNDS = per_field(rotation=(-7.0, 7.0))

    id: String = ""
    places: tuple[Place, ...] = ()
    zones: tuple[MapZone, ...] = ()
    deleted_places: StringArray = ()
    deleted_zones: StringArray = ()
    strokes: tuple[MapStroke, ...] = ()
    crop: tuple[Point, ...] = ()
    rotation: Float64 = 0.0
    new: Bool = False
    keep_poses: Bool = False
    undo: Bool = False
    preview: Bool = False
    seen_change: String = ""
    edited_by: String = ""
    """Name of the person, empty if it is not known."""


class MapEditResult(Message, frozen=True, eq=False):
    """What a change of the map has done or, for a preview, would do."""

    ROS_PACKAGE = "chefbot_msgs"

    id: String = ""
    applied: Bool = False
    description: String = ""
    """A sentence: what is wrong with the change, or which places it cuts off; empty if there is nothing to say."""
    undoable: Uint32 = 0
    """Number of changes that can be taken back."""
    last_id: String = ""
    """Id of the last change that can be taken back."""
    last_change: String = ""
    """What that has changed, as "Table 1 was moved"; places have the labels of that time."""
    last_edited_by: String = ""
    """Name of the person who made it, empty if it is not known."""


def whole_poses(message: Any) -> str:
    """Require three numbers for each pose."""
    return f"poses: {len(message.poses)} numbers are not poses of three" if len(message.poses) % 3 else ""


class MapTrajectory(Message, frozen=True, eq=False):
    """Poses of the robot in the map at all scans that are part of it, as the mapper knows them now."""

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(poses=3 * MAX_TRAJECTORY)
    RULES = (whole_poses,)

    header: Header = Header()
    poses: Float64Array = _NO_DOUBLES
    """x and y, m, and yaw, rad, of one pose after the other."""
    range_offset: Float64 = 0.0
    """Correction of all ranges that the mapper has found, m."""


class MappedScan(Message, frozen=True, eq=False):
    """A scan as the mapper has processed it; from those of a drive its map can be built again.

    Beams of `angles` (rad, in the frame of the header) and `ranges` (m); none of a scan that is not part of the map.
    """

    ROS_PACKAGE = "chefbot_msgs"

    BOUNDS = per_field(range_max=DISTANCE)
    MAX_LENGTHS = per_field(angles=MAX_BEAMS, ranges=MAX_BEAMS, mapper=MAX_MAPPER)
    RULES = (same_length("angles", "ranges"),)

    header: Header = Header()
    number: Uint32 = 0
    """Number of the scan in the drive, from 0."""
    continued: Bool = False
    """Whether the drive continues a map that was there before it."""
    used: Bool = False
    """Whether the scan is part of the map."""
    odometry: PlanarPose = _ORIGIN
    """Pose of the robot in odom."""
    start: PlanarPose = _ORIGIN
    """Pose of the robot in the map at the first scan of the drive."""
    laser: PlanarPose = _ORIGIN
    """Pose of the laser in base_link."""
    range_max: Float32 = 0.0
    angles: Float32Array = _NO_FLOATS
    ranges: Float32Array = _NO_FLOATS
    mapper: String = ""
    """Algorithm and parameters, JSON."""
