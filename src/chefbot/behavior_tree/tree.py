"""A behavior tree that can be ticked."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from chefbot.behavior_tree.blackboard import Blackboard
from chefbot.behavior_tree.leaves import ActionLeaf, Pending


class NodeState(NamedTuple):
    """A node of a tree for display: its depth, type and name, and its status in lower case."""

    depth: int
    type: str
    name: str
    status: str
    feedback: str


class BehaviorTree:
    """A tree of nodes with their blackboard.

    types: by id of the node, the name of its type.
    """

    def __init__(self, root: Behaviour, blackboard: Blackboard, types: dict[int, str]) -> None:
        self.root, self.blackboard, self._types = root, blackboard, types

    def tick(self, now_ns: int) -> Status:
        """Tick the tree at a time and return the status of its root."""
        self.blackboard.now_ns = now_ns
        self.root.tick_once()
        return self.root.status

    def halt(self) -> None:
        """Stop all nodes; what they have begun is cancelled."""
        self.root.stop(Status.INVALID)

    @property
    def pending(self) -> list[Pending]:
        """What the running actions wait for."""
        nodes = (node for node in self.root.iterate() if isinstance(node, ActionLeaf))
        return [node.pending for node in nodes if node.pending is not None and not node.pending.done]

    def type_of(self, node: Behaviour) -> str:
        """Return the name of a node's type."""
        return self._types[id(node)]

    def states(self) -> list[NodeState]:
        """Return the state of every node, parents before their children."""
        return list(self._states(self.root, 0))

    def _states(self, node: Behaviour, depth: int) -> Iterator[NodeState]:
        status = "idle" if node.status is Status.INVALID else node.status.value.lower()
        yield NodeState(depth, self.type_of(node), node.name, status, node.feedback_message)
        for child in node.children:
            yield from self._states(child, depth + 1)
