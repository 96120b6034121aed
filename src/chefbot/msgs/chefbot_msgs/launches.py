"""Messages of chefbot_msgs about the launch that runs, and about another one in its place."""

from __future__ import annotations

from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Bool, Message, String, StringArray


class LaunchRequest(Message, frozen=True, eq=False):
    """A request to end the present launch and to run another one on the same robot.

    `arguments`: of the other one, each `key:=value`; the rest is as in the present one.
    """

    ROS_PACKAGE = "chefbot_msgs"

    MAX_LENGTHS = per_field(arguments=100)

    launch: String = ""
    arguments: StringArray = ()


class LaunchStatus(Message, frozen=True, eq=False):
    """The launch that runs, and can be replaced by another one by a LaunchRequest."""

    ROS_PACKAGE = "chefbot_msgs"

    launch: String = ""
    mapping: Bool = False
    """Whether it makes a map."""
    map_file: String = ""
    """Path of the map that it uses; empty if that is the simulated world's own, or if it makes one."""
    notice: String = ""
    """Why it runs, if it was not requested: the requested one cannot."""


class MapFolder(Message, frozen=True, eq=False):
    """The folder in which the map of a mapping launch is kept with its drive; empty if it is not kept."""

    ROS_PACKAGE = "chefbot_msgs"

    folder: String = ""
