"""The places that a world's file names, for a robot that has no saved map yet."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.chefbot_msgs import Place, Places
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.node import Device, Out, topic
from chefbot.sim.world.load import load_any_world, with_places


class WorldPlacesParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Of which world."""

    world: Annotated[str, Meta(min_length=1, description="a world's name, a world file, or a ROS map.yaml")]
    start: Annotated[str, Meta(description="where the robot starts, as the simulator has it")] = ""
    seed: Annotated[
        int, Meta(ge=0, description="of the places that are drawn where the world names none")
    ] = 1


class WorldPlacesDevice(Device):
    """Publishes them once, for all who come later too, on the map that begins where the robot starts.

    It is the owner who knows where the tables are; a mapper's drift shows as tables that seem to have moved.
    """

    params: WorldPlacesParams
    places: Out[Places] = topic(latched=True)

    def start(self) -> None:
        """Read the world now, so that a fault stops the start; speak as soon as the loop runs."""
        world = load_any_world(self.params.world, self.robot, self.params.start)
        world = with_places(world, self.robot, self.params.seed)
        self._places = {name: world.start.between(pose) for name, pose in world.places.items()}
        self.post(self._publish)

    def _publish(self) -> None:
        header = Header.of(self.now_ns, "map")
        named = (Place(name, PoseStamped(header, Pose.of(pose))) for name, pose in self._places.items())
        self.places.publish(Places(tuple(named)))
