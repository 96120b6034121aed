"""`chefbot drive place`: named places on the map of a running robot."""

from __future__ import annotations

from typing import Any
from uuid import uuid4

from rich.console import Console

from chefbot.cli import running_robot
from chefbot.cli.drive.goals import pose_of
from chefbot.cli.running_robot import ADD_PLACES, known_places, pose_text
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.place_names import display_name
from chefbot.storage.places import name_of_place
from chefbot.ui.commands import DeletePlace, PutPlace
from chefbot.ui.remote.web_ui_client import WebUiClient

console = Console(highlight=False, soft_wrap=True, markup=False)


def put_place(name: str, pose: list[str], page: str) -> None:
    """Store a pose (X Y [YAW], m and degrees), or where the robot is, as a place of this name on its map.

    A number is that of a table. Raises UserError for an invalid pose, without a pose of the robot, or if the map
    server refuses the place or its name.
    """
    name = name_of_place(name)
    with WebUiClient(page) as robot:
        places = known_places(robot)
        at = pose_of(pose) if pose else _robot_pose(robot)
        label = (robot.wait_for("labels", running_robot.LAYER_TIMEOUT) or {}).get(name, "")
        _edit(robot, PutPlace(at.x, at.y, at.yaw, name, label=label, id=uuid4().hex))
    moved = "is now" if name in places else "is a new place"
    console.print(f"{display_name(name)} {moved} at {pose_text(at)}.")


def remove_place(name: str, page: str) -> None:
    """Remove a place from the map of a running robot; raises UserError for an unknown one, or if it is refused."""
    with WebUiClient(page) as robot:
        found = running_robot.find_shown_place(robot, name, known_places(robot))
        _edit(robot, DeletePlace(found, id=uuid4().hex))
    console.print(f"{display_name(found)} is no longer a place.")


def print_places(page: str) -> None:
    """Print the named places of a running robot with their poses in the map frame."""
    with WebUiClient(page) as robot:
        places = known_places(robot)
        labels = robot.latest.get("labels") or {}
    for name, at in sorted(places.items()):
        label = f"  {labels[name]}" if name in labels else ""
        console.print(f"{name:16} {pose_text(at)}{label}")
    if not places:
        console.print(f"The robot has no named places; {ADD_PLACES}.")


def _robot_pose(robot: WebUiClient) -> SE2:
    at = robot.wait_for("robot", running_robot.RESPONSE_TIMEOUT)
    if at is None:
        raise UserError(f"the robot at {robot.url} does not know where it is; give a pose X Y [YAW]")
    return SE2(at["x"], at["y"], at["yaw"])


def _edit(robot: WebUiClient, command: PutPlace | DeletePlace) -> None:
    """Send a change of the map; raises UserError with the reason if it is not applied, or without an answer."""
    robot.send(command)

    def own() -> list[dict[str, Any]]:
        return [one for one in robot.latest.get("edits") or () if one["id"] == command.id]

    if not robot.wait_until(lambda: bool(own()), running_robot.RESPONSE_TIMEOUT):
        raise UserError(
            f"the robot at {robot.url} has not stored the place; it must run `chefbot launch amcl_demo` or another "
            "launch with a map server"
        )
    result = own()[0]
    if not result["applied"]:
        raise UserError(f"not stored: {result['description']}")
    if result["description"]:
        console.print(result["description"])
