"""Device that publishes the places named in a world file, for a robot without a saved map."""

from __future__ import annotations

import msgspec

from chefbot.msgs.chefbot_msgs import Place, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Device, Out, topic
from chefbot.sim.world.load import (
    PlacesSeed,
    StartPose,
    UnknownParam,
    WorldName,
    load_any_world,
    with_drawn_places,
)


class WorldPlacesParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters: the world whose places are published."""

    world: WorldName
    start: StartPose = ""
    unknown: UnknownParam = "auto"
    seed: PlacesSeed = 1


class WorldPlacesDevice(Device):
    """Publishes a world's places once, transient local, in the map frame that begins at the robot's start.

    The positions are true, as an owner would enter them; a mapper's drift shows as an offset of the tables.
    """

    params: WorldPlacesParams
    places: Out[Places] = topic(latched=True)

    def start(self) -> None:
        """Read the world now, so that an error aborts the start; publish as soon as the loop runs."""
        p = self.params
        world = load_any_world(p.world, self.robot, p.start, p.unknown)
        world = with_drawn_places(world, self.robot, p.seed)
        self._places = {name: world.start.between(pose) for name, pose in world.places.items()}
        self.post(self._publish)

    def _publish(self) -> None:
        header = Header.of(self.now_ns, "map")
        places = (Place(name, PoseStamped(header, Pose.of(pose))) for name, pose in self._places.items())
        self.places.publish(Places(tuple(places)))
