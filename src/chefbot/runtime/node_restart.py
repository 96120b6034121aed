"""Restart of nodes whose callbacks keep raising exceptions, and what the loss of a node means for the others."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from functools import partial
from typing import TypeVar

import numpy as np

from chefbot.msgs.action_msgs import STATUS_ABORTED
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Empty, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.runtime.actions import ActionClientPort, ActionServerPort, failed_result
from chefbot.runtime.loop import DEVICE, Loop, Publication
from chefbot.runtime.node import RESTARTED, RESTORED_PREFIX, In, Node
from chefbot.runtime.transform_buffer import TransformBuffer, TransformError

LOST_TOPIC = "chefbot/lost"
"""Topic of the names of nodes that do not run any more; the goals that they were given are aborted."""
RECOVER_TOPIC = "chefbot/recover"
"""Topic of the names of nodes that are created again with the state that they had published."""
PROCESS_LOST, PROCESS_BACK = "process_lost", "process_back"
"""Topics on which the drive base learns that the robot has to stand, and that navigation counts again."""
SERVER_LOST = 9003
"""Error code of the result of a goal whose server does not run any more."""
FAULT_LIMIT = 3
"""Number of exceptions of a node within FAULT_WINDOW_NS from which it is restarted."""
FAULT_WINDOW_NS = 1_000_000_000
"""Length of the sliding window in which exceptions of a node are counted, ns."""
MIN_DELAY_NS, MAX_DELAY_NS = 500_000_000, 10_000_000_000
"""Delay before a node is restarted, ns; doubled at each restart up to the maximum."""
STABLE_NS = 10_000_000_000
"""Time without a restart after which the delay is the minimum again, ns."""
PUBLISHER = "chefbot"
P = TypeVar("P")


class NodeRestarts:
    """Restarts nodes that keep raising exceptions; the robot stands until they run again.

    All that it does are messages of a device, so that a replay of the log repeats it.
    """

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self._recent_ns: dict[str, deque[int]] = {}
        self._delay_ns: dict[str, int] = {}
        self._restarted_ns: dict[str, int] = {}
        self._waiting: set[str] = set()

    def count_exception(self, node: str) -> None:
        """Count an exception of a node now; restart the node after a delay if it is one too many."""
        now_ns = self._loop.now_ns
        recent = self._recent_ns.setdefault(node, deque(maxlen=FAULT_LIMIT))
        recent.append(now_ns)
        if node in self._waiting or len(recent) < FAULT_LIMIT or now_ns - recent[0] > FAULT_WINDOW_NS:
            return
        self._waiting.add(node)
        self._publish(PROCESS_LOST, node)
        # a nanosecond later than a multiple of usual periods: messages of that instant still arrive
        restart_ns = now_ns + self._back_off(node) + 1
        self._loop.schedule(restart_ns, DEVICE, partial(self._restart, node))

    def _back_off(self, node: str) -> int:
        stable = self._loop.now_ns - self._restarted_ns.get(node, -STABLE_NS) >= STABLE_NS
        delay_ns = MIN_DELAY_NS if stable else self._delay_ns[node]
        self._delay_ns[node] = min(2 * delay_ns, MAX_DELAY_NS)
        return delay_ns

    def _restart(self, node: str) -> None:
        self._waiting.discard(node)
        self._recent_ns.pop(node, None)
        self._restarted_ns[node] = self._loop.now_ns
        self._publish(RECOVER_TOPIC, node)
        self._publish(PROCESS_BACK, node)

    def _publish(self, topic: str, node: str) -> None:
        self._loop.publish(topic, String(node), PUBLISHER, from_device=True)


def abort_goals(loop: Loop, lost: Node, nodes: Iterable[Node], sentence: str) -> None:
    """Publish for each goal that `lost` was given that it is aborted; `nodes` may have sent some of them."""
    nodes = list(nodes)
    for server in _ports(lost, ActionServerPort):
        goals = dict.fromkeys(server.goal_keys)
        for node in nodes:
            for client in _ports(node, ActionClientPort):
                goals.update(dict.fromkeys(client.goal_keys if client.name == server.name else ()))
        result = failed_result(server.action, SERVER_LOST, sentence)
        for key in goals:
            goal_id = UUID(np.frombuffer(key, np.uint8))
            outcome = server.action.outcome(goal_id, STATUS_ABORTED, Time.of(loop.now_ns), result)
            loop.publish(f"{server.name}/_action/get_result", outcome, PUBLISHER, from_device=True)


def restored_state(node: Node, loop: Loop, transforms: TransformBuffer) -> list[Publication]:
    """Return the messages that restore the state of a node, as after a restart of its process."""
    latched = {publication.topic: publication.message for publication in loop.latched()}
    state = []
    for port in _ports(node, In):
        name = port.topic.removeprefix(RESTORED_PREFIX)
        if name == port.topic or name == RESTARTED:
            continue
        message = _map_transform(loop, transforms) if name == "tf" else latched.get(node.resolve(name))
        if message is not None:
            state.append(_restored(loop, name, message))
    return [*state, _restored(loop, RESTARTED, Empty())]


def _restored(loop: Loop, name: str, message: Message) -> Publication:
    return Publication(RESTORED_PREFIX + name, message, PUBLISHER, True, loop.now_ns, False)


def _map_transform(loop: Loop, transforms: TransformBuffer) -> TFMessage | None:
    try:
        pose = transforms.lookup("map", "odom")
    except TransformError:
        return None
    return TFMessage((TransformStamped.of(loop.now_ns, "map", "odom", pose),))


def _ports(node: Node, kind: type[P]) -> Iterator[P]:
    for value in vars(node).values():
        if isinstance(value, kind):
            yield value
