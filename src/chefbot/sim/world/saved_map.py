"""Devices for a simulated robot on a saved map: the map, its places, and the start pose on it."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from chefbot.devices.initial_pose import InitialPoseDevice, InitialPoseParams
from chefbot.devices.maps.map_file import MapFileDevice, MapFileParams
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.sim.world.load import (
    PlacesSeed,
    StartPose,
    UnknownParam,
    WorldName,
    load_any_world,
    map_to_localize_on,
    shares_map_frame,
    with_drawn_places,
)
from chefbot.storage.places import entry_of


class SavedMapParams(MapFileParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the saved map and of the world that it shows."""

    map: Annotated[
        str,
        Meta(description="path of a ROS map file; empty: the world's own, else the map saved by the demo"),
    ] = ""
    world: WorldName
    start: StartPose = ""
    unknown: UnknownParam = "auto"
    seed: PlacesSeed = 1


class SavedMapDevice(MapFileDevice):
    """A MapFileDevice that, if the world is made of the map itself, publishes that world's places."""

    params: SavedMapParams
    world_frame = True

    def read(self) -> None:
        """Read the map files, and the places of the world if it is made of this map."""
        p = self.params
        self.read_map(map_to_localize_on(p.world, p.map))
        if shares_map_frame(p.world, p.map):
            world = load_any_world(p.world, self.robot, p.start, p.unknown)
            drawn = with_drawn_places(world, self.robot, p.seed).places
            self.named = {name: self.named.get(name, entry_of(pose)) for name, pose in drawn.items()}


class StartPoseParams(InitialPoseParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the initial pose on the map; three zeros mean the robot's start pose."""

    map: Annotated[str, Meta(description="the map that localization uses; empty: the world's own")] = ""
    world: WorldName
    start: StartPose = ""
    unknown: UnknownParam = "auto"


class StartPoseDevice(InitialPoseDevice):
    """An InitialPoseDevice that, without a given pose, uses the true start in a world made of the map itself.

    In other worlds the map begins where mapping began, which is where the simulated robot starts again.
    """

    params: StartPoseParams

    def pose(self) -> SE2:
        """Return the initial pose on the map."""
        p = self.params
        given = super().pose()
        if given != IDENTITY or not shares_map_frame(p.world, p.map):
            return given
        return load_any_world(p.world, self.robot, p.start, p.unknown).start
