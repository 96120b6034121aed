"""Trees whose leaves return the statuses of a script, one for each tick."""

from __future__ import annotations

from py_trees.common import Status

from chefbot.behavior_tree.blackboard import NodePort, NodePorts
from chefbot.behavior_tree.bt_xml import build_tree, read_tree_file
from chefbot.behavior_tree.catalog import CONTROL_NODES, Catalog, NodeKind, NodeType
from chefbot.behavior_tree.leaves import Leaf
from chefbot.behavior_tree.tree import BehaviorTree

STATUS = {"S": Status.SUCCESS, "F": Status.FAILURE, "R": Status.RUNNING}
LETTER = {status: letter for letter, status in STATUS.items()}


class Scripted(Leaf):
    """A leaf with a script such as `RRS`; the last letter repeats. It counts ticks and stops."""

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self.ticks = self.stops = 0

    def update(self) -> Status:
        script = self.ports.text("script")
        self.ticks += 1
        return STATUS[script[min(self.ticks, len(script)) - 1]]

    def terminate(self, new_status: Status) -> None:
        self.stops += new_status is Status.INVALID and self.status is Status.RUNNING


CATALOG: Catalog = {
    **CONTROL_NODES,
    "Leaf": NodeType(NodeKind.ACTION, Scripted, (NodePort("script", str, default="S"),)),
}


def scripted(body: str) -> BehaviorTree:
    """Return the tree of an XML body."""
    text = f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree></root>'
    return build_tree(read_tree_file(text.encode(), "t.xml"), CATALOG)


def run(tree: BehaviorTree, ticks: int, period_s: float = 0.1, start_s: float = 0.0) -> str:
    """Return the letters of the root's statuses."""
    return "".join(LETTER[tree.tick(round((start_s + k * period_s) * 1e9))] for k in range(ticks))


def leaf(tree: BehaviorTree, name: str) -> Scripted:
    """Return the leaf of this name."""
    return next(node for node in tree.root.iterate() if node.name == name and isinstance(node, Scripted))
