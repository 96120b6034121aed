"""What each role may command at the web UI."""

from __future__ import annotations

from typing import get_args

from chefbot.ui import commands as do
from chefbot.ui.access.visitors import Role

ROLES: tuple[Role, ...] = get_args(Role)
"""In the order of what they may do: each may do what those before it may."""
NEEDED_ROLE: dict[type[do.OperatorCommand], Role] = {
    # 1. Everybody who sees the robot can stop it.
    **dict.fromkeys((do.Stop, do.Withdraw, do.Ping, do.Show, do.Received), "guest"),
    # 2. Deliveries, and what goes with them.
    **dict.fromkeys(
        (
            do.Deliver, do.Loaded, do.Taken, do.NotTaken, do.Choose, do.ChangeQueue, do.ShortestOrder,
            do.GoPlace, do.Cancel, do.ReleaseStop, do.LeaveKiosk,
        ),
        "waiter",
    ),
    # 3. To drive anywhere, to change the map, and to see and keep what happened.
    **dict.fromkeys(
        (
            do.Goal, do.Patrol, do.Follow, do.Drive, do.InitialPose, do.MapSaved, do.SaveIncident, do.Record,
            do.Playback, do.PutPlace, do.DeletePlace, do.PutZone, do.DeleteZone, do.DrawOnMap,
            do.CropMap, do.RotateMap, do.UndoMapEdit, do.Explore, do.ResetMap, do.SaveMap,
            do.SendMap, do.MapBuilding, do.DriveOnMap,
        ),
        "manager",
    ),
    # 4. The simulated world, and the ROS graph with the nodes' parameters.
    **dict.fromkeys(
        (do.DropBox, do.Kidnap, do.OpenDoor, do.CloseDoor, do.Inspect, do.SetParameter, do.InspectCell), "engineer"
    ),
}  # fmt: skip
"""The role that a command needs."""
LAYER_ROLE: dict[str, Role] = {
    # pictures of people, and who did what
    **dict.fromkeys(("camera", "depth", "history", "causes"), "waiter"),
    **dict.fromkeys(("incidents", "map_bundle"), "manager"),
    # the ROS graph
    **dict.fromkeys(("graph", "values", "parameters", "log", "cell"), "engineer"),
}
"""The role that a layer needs; everybody sees the others."""
SEES_RECORDINGS: Role = "manager"
"""The role that files of incidents and pictures of causes need: they may show people."""
ONLY_VIEW = "This link can only view the robot and press STOP; ask for a waiter's link"
TITLES: dict[Role, str] = {
    "guest": "a guest",
    "waiter": "a waiter",
    "manager": "a manager",
    "engineer": "an engineer",
}


def may(role: Role, needed: Role) -> bool:
    """Return whether a role may do what another one needs to be."""
    return ROLES.index(role) >= ROLES.index(needed)


def hidden_layers(role: Role) -> frozenset[str]:
    """Return the layers that are not sent to a role."""
    return frozenset(layer for layer, needed in LAYER_ROLE.items() if not may(role, needed))


def refusal(role: Role, command: do.OperatorCommand) -> str:
    """Return why a role may not give a command, empty if it may."""
    needed = NEEDED_ROLE[type(command)]
    if may(role, needed):
        return ""
    if role == "guest":
        return ONLY_VIEW
    return f"A link for {TITLES[role]} does not allow this; ask for one for {TITLES[needed]}"
