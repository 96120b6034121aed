"""Messages that count only from the robot's own processes: commands of wheels, another launch, maps of the launch."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import LaunchRequest, LaunchStatus, MapFolder, WheelSpeeds
from chefbot.msgs.chefbot_msgs.maps import MapZones, Places
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.graph import Endpoint, Graph
from chefbot.runtime.node_container import PARAMS_TOPIC

LOCAL_ONLY_TYPES: tuple[type[Message], ...] = (WheelSpeeds, LaunchRequest, LaunchStatus, MapFolder)
"""Message types that the motor board and the launcher obey at once, or that name files. All others may come from
anyone on the wire: commands such as /cmd_vel_teleop and goals go through the drive base, which enforces the
emergency stop and the limits; measurements may come from external drivers."""
MAP_TYPES: tuple[type[Message], ...] = (OccupancyGrid, MapZones, Places)
"""Types of the map, its zones and places: where the launch publishes them, two sources would contradict."""
LOCAL_TOPICS = frozenset(
    {"process_lost", "process_back", "board_connected", "board_fault", "battery/stored_log", PARAMS_TOPIC}
)
"""Topics by which the launch, the motor board and the disk report to nodes of their own process: never bridged."""
MAIN_NODE_NAME = "chefbot"
"""Name of the node that represents a launch's main process if it joins no robot; a launch that joins
identifies the robot by it."""


def process_node(process: str) -> str:
    """Return the name of the node that represents another process of a launch, or a launch that joins it."""
    return f"{MAIN_NODE_NAME}_{process}"


class LocalProcessFilter:
    """Identifies the participants on the wire that are processes of the robot in `namespace`.

    Each process has a node of its own. The check keeps a tool or a foreign node from driving the wheels by
    mistake; against malice there is the secure router's access control.
    """

    def __init__(self, graph: Graph, namespace: str) -> None:
        self._graph, self._namespace = graph, namespace
        self._accepted_gids: set[bytes] = set()

    def check(self, topic: str, gid: bytes) -> None:
        """Raise RmwError unless publisher `gid` of the topic is in a process of the robot.

        `topic` is fully qualified.
        """
        self._check(topic, gid, "drive by cmd_vel_teleop, map in the web UI", or_unknown=False)

    def check_map(self, topic: str, gid: bytes) -> None:
        """Raise RmwError if publisher `gid` of a map is known to be in no process of the robot.

        A latched message of the robot's own map server may come before the server is known.
        """
        self._check(topic, gid, "stop one of them", or_unknown=True)

    def _check(self, topic: str, gid: bytes, advice: str, *, or_unknown: bool) -> None:
        if gid in self._accepted_gids:
            return
        publishers = self._publishers(topic)
        sender = next((publisher.node for publisher in publishers if publisher.gid == gid), None)
        if sender is None and or_unknown:
            return
        if sender is None or sender.zid not in self._own_sessions():
            sender_name = "an unknown publisher" if sender is None else sender.full_name
            raise RmwError(f"{sender_name} may not publish this: only the robot's own launch; {advice}")
        self._accepted_gids.add(gid)

    def foreign_publishers(self, topic: str) -> list[str]:
        """Return the full names of foreign nodes that publish on a topic (fully qualified)."""
        own_sessions = self._own_sessions()
        nodes = [publisher.node for publisher in self._publishers(topic)]
        return sorted({node.full_name for node in nodes if node.zid not in own_sessions})

    def _publishers(self, topic: str) -> tuple[Endpoint, ...]:
        endpoints = self._graph.topics().get(topic)
        return endpoints.providers if endpoints else ()

    def _own_sessions(self) -> set[str]:
        """Return the Zenoh session ids of the robot's processes."""
        return {
            node.zid
            for node in self._graph.nodes()
            if node.namespace == self._namespace
            and (node.name == MAIN_NODE_NAME or node.name.startswith(f"{MAIN_NODE_NAME}_"))
        }
