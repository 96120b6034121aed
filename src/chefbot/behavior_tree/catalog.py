"""The types of nodes that a behavior tree can have, by the names of BehaviorTree.CPP and Nav2."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import NamedTuple

from py_trees.behaviour import Behaviour
from py_trees.composites import Selector, Sequence

from chefbot.behavior_tree import controls, decorators
from chefbot.behavior_tree.blackboard import NodePort, NodePorts

MAX_CHILDREN = 1000


class NodeKind(Enum):
    """Kinds of nodes, with the names that BehaviorTree.CPP's XML has for them."""

    CONTROL = "Control"
    DECORATOR = "Decorator"
    ACTION = "Action"
    CONDITION = "Condition"


class NodeType(NamedTuple):
    """A type of nodes. `make` takes a name and the node's ports; children are added afterwards."""

    kind: NodeKind
    make: Callable[[str, NodePorts], Behaviour]
    ports: tuple[NodePort, ...] = ()
    children: tuple[int, int] = (0, 0)
    """Minimum and maximum number of children."""


Catalog = Mapping[str, NodeType]
"""Types of nodes by name."""


def _control(
    make: Callable[[str, NodePorts], Behaviour],
    *ports: NodePort,
    children: tuple[int, int] = (1, MAX_CHILDREN),
) -> NodeType:
    return NodeType(NodeKind.CONTROL, make, ports, children)


def _decorator(make: Callable[[str, NodePorts], Behaviour], *ports: NodePort) -> NodeType:
    return NodeType(NodeKind.DECORATOR, make, ports, (1, 1))


CONTROL_NODES: Catalog = {
    "Sequence": _control(lambda name, _: Sequence(name, memory=True)),
    "ReactiveSequence": _control(lambda name, _: Sequence(name, memory=False)),
    "Fallback": _control(lambda name, _: Selector(name, memory=True)),
    "ReactiveFallback": _control(lambda name, _: Selector(name, memory=False)),
    "Parallel": _control(
        controls.Parallel,
        NodePort("success_count", int, default="-1", minimum=-1),
        NodePort("failure_count", int, default="1", minimum=-1),
    ),
    "PipelineSequence": _control(controls.PipelineSequence),
    "RecoveryNode": _control(
        controls.RecoveryNode, NodePort("number_of_retries", int, default="1", minimum=0), children=(2, 2)
    ),
    "RoundRobin": _control(controls.RoundRobin),
    "Inverter": _decorator(decorators.Inverter),
    "ForceSuccess": _decorator(decorators.ForceSuccess),
    "ForceFailure": _decorator(decorators.ForceFailure),
    "KeepRunningUntilFailure": _decorator(decorators.KeepRunningUntilFailure),
    "Repeat": _decorator(decorators.Repeat, NodePort("num_cycles", int, minimum=-1)),
    "RetryUntilSuccessful": _decorator(
        decorators.RetryUntilSuccessful, NodePort("num_attempts", int, minimum=-1)
    ),
    "Timeout": _decorator(decorators.Timeout, NodePort("msec", float, minimum=0.0)),
    "Delay": _decorator(decorators.Delay, NodePort("delay_msec", float, minimum=0.0)),
    "RateController": _decorator(
        decorators.RateController, NodePort("hz", float, default="10.0", minimum=1e-3)
    ),
    "SingleTrigger": _decorator(decorators.SingleTrigger),
}
"""Control nodes and decorators, which every tree can have."""
