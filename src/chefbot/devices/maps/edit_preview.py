"""What a change of the map would do to the robot and its places, in sentences, before anything is written."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from chefbot.devices.cut_off import Walls, cut_off, reach, without_room
from chefbot.devices.maps.map_content import MapChange, MapContent
from chefbot.maths.polygon import contains
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.maps import KEEP_OUT
from chefbot.place_names import display_name
from chefbot.robot.spec import Robot
from chefbot.zones.contradictions import check_zones

NO_PATH = "No path from the robot to: {}."
NO_PATH_BACK = "No path back to the robot from: {}."
NO_ROOM = "Too near to a wall for the robot: {}."


def side_effects(robot: Robot, change: MapChange, start: SE2 | None) -> str:
    """Return what a change would do, empty if it has no side effects.

    start: the robot's pose in the map frame, from which the places are to be reached; None if it is not known.
    """
    before, after = change
    known = check_zones(before.zones, before.grid, before.poses()).warnings
    found = check_zones(after.zones, after.grid, after.poses()).warnings
    sentences = [sentence for sentence in found if sentence not in known]
    if start is not None and (after.zones != before.zones or after.grid is not before.grid):
        sentences += _effects_on_paths(robot, change, start, " ".join(sentences))
    elif start is not None:
        sentences += _new_places_out_of_reach(robot, change, start)
    return " ".join(sentences)


def _effects_on_paths(robot: Robot, change: MapChange, start: SE2, reported: str) -> Iterator[str]:
    """Yield what happens to a robot at `start` and to its paths; places that `reported` names are left out."""
    before, after = change
    if _new_without_room(robot, change, {"robot": start}):
        yield "The robot would then be inside a wall, or too near to one."
        return
    traps = [zone.title for zone in after.of_kind(KEEP_OUT) if contains(zone.array, start.x, start.y)]
    if traps:
        yield f"The robot is in the {traps[0]} and cannot leave it by itself."
        return
    walls = (Walls(before.grid, before.zones), Walls(after.grid, after.zones))
    lost = cut_off(robot, start, after.poses(), *walls)
    if outside := [name for name in lost.no_path if f" {name} " not in reported]:
        yield NO_PATH.format(_titles(outside, after))
    if lost.no_path_back:
        yield NO_PATH_BACK.format(_titles(lost.no_path_back, after))
    if narrow := sorted(_new_without_room(robot, change, after.poses()) - set(outside)):
        yield NO_ROOM.format(_titles(narrow, after))


def _new_places_out_of_reach(robot: Robot, change: MapChange, start: SE2) -> Iterator[str]:
    """Yield which places that are new or elsewhere have no path from `start`, or no room for the robot."""
    before, after = change
    known = before.poses()
    changed = {name: pose for name, pose in after.poses().items() if known.get(name) != pose}
    if not changed:
        return
    found = reach(Walls(after.grid, after.zones), robot, start, changed)
    if apart := [name for name in changed if name not in found.there]:
        yield NO_PATH.format(_titles(apart, after))
    if stuck := [name for name in changed if name in found.there - found.back]:
        yield NO_PATH_BACK.format(_titles(stuck, after))
    if narrow := sorted(without_room(after.grid, robot, changed) & found.there):
        yield NO_ROOM.format(_titles(narrow, after))


def _titles(names: Iterable[str], content: MapContent) -> str:
    return ", ".join(display_name(name, content.places[name].label) for name in names)


def _new_without_room(robot: Robot, change: MapChange, poses: Mapping[str, SE2]) -> set[str]:
    """Return the poses at which a changed map leaves no room for the robot; zones leave it outside of them."""
    before, after = change
    if after.grid is before.grid:
        return set()
    changed = without_room(after.grid, robot, poses)
    return changed - without_room(before.grid, robot, poses)
