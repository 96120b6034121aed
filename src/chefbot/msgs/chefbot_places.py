"""Messages of chefbot_msgs about the named places of a map, and changes of its places and zones."""

from __future__ import annotations

from chefbot.msgs.chefbot_zones import MAX_ZONES, MapZone
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Bool, Float64, Message, String, StringArray, Uint32

MAX_PLACES = 1000
"""Maximum number of places of a map."""


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


class MapEdit(Message, frozen=True, eq=False):
    """A change of the places and zones of the map, which replaces those of the same name.

    With `new`, nothing is replaced: a name that is taken becomes the next free one. With `keep_poses`, places that
    exist stay where they are. With `undo`, the last change is taken back; with `preview`, only the result is
    published.
    """

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(
        **dict.fromkeys(("places", "deleted_places"), MAX_PLACES),
        **dict.fromkeys(("zones", "deleted_zones"), MAX_ZONES),
    )

    id: String = ""
    places: tuple[Place, ...] = ()
    zones: tuple[MapZone, ...] = ()
    deleted_places: StringArray = ()
    deleted_zones: StringArray = ()
    new: Bool = False
    keep_poses: Bool = False
    undo: Bool = False
    preview: Bool = False


class MapEditResult(Message, frozen=True, eq=False):
    """What a change of the map has done or, for a preview, would do."""

    ROS_PACKAGE = "chefbot_msgs"

    id: String = ""
    applied: Bool = False
    description: String = ""
    """A sentence: what is wrong with the change, or which places it cuts off; empty if there is nothing to say."""
    undoable: Uint32 = 0
    """Number of changes that can be taken back."""
