"""Orders that go past STOP and the speed limits: heard from the robot's own processes only."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.idl.message import Message
from chefbot.ros2.rmw.errors import WireError
from chefbot.ros2.rmw.graph import Graph

INNER: tuple[type[Message], ...] = (WheelSpeeds,)
"""What a motor board obeys at once. All else may come from anybody on the wire: orders such as /cmd_vel_teleop and
goals go through the base, which keeps STOP and the limits; measurements may come from somebody else's drivers."""
NEVER_HEARD = frozenset({"process_lost", "process_back"})
"""What the launch tells its own base about its processes: not on the wire at all."""
LEADER = "chefbot"
"""The node that speaks for a launch's own process, if it joins no other; who joins knows the robot by it."""


def process_node(process: str) -> str:
    """What the node is called that speaks for another process of a launch, or for one that joins it."""
    return f"{LEADER}_{process}"


class Insiders:
    """Knows who of those on the wire is a process of the robot in `namespace`: each has a node of its own for itself.

    It keeps a tool or a foreign node from driving the wheels by mistake; against malice there are the gate's rules.
    """

    def __init__(self, graph: Graph, namespace: str) -> None:
        self._graph, self._namespace = graph, namespace
        self._known: set[bytes] = set()

    def check(self, topic: str, gid: bytes) -> None:
        """WireError unless the publisher `gid` of the topic, a full name, is in such a process."""
        if gid in self._known:
            return
        named = self._graph.topics().get(topic)
        sender = next((one.node for one in named.givers if one.gid == gid), None) if named else None
        if sender is None or sender.zid not in self._processes():
            who = "somebody unknown" if sender is None else sender.full_name
            raise WireError(f"{who} may not say this: only the robot's own launch; drive by cmd_vel_teleop")
        self._known.add(gid)

    def strangers(self, topic: str) -> list[str]:
        """Full names of nodes of others that publish on a topic, a full name."""
        named = self._graph.topics().get(topic)
        ours = self._processes()
        return (
            sorted({one.node.full_name for one in named.givers if one.node.zid not in ours}) if named else []
        )

    def _processes(self) -> set[str]:
        """Their sessions."""
        return {
            one.zid
            for one in self._graph.nodes()
            if one.namespace == self._namespace and (one.name == LEADER or one.name.startswith(f"{LEADER}_"))
        }
