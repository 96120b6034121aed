"""The types of nodes that a behavior tree can have, by the names of BehaviorTree.CPP and Nav2."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from enum import Enum
from functools import partial
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

    @property
    def description(self) -> str:
        """What such a node does, from the docstring of its class or factory."""
        make = self.make.func if isinstance(self.make, partial) else self.make
        return inspect.getdoc(make) or ""


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


def sequence(name: str, _: NodePorts) -> Behaviour:
    """Ticks one child after the other while they succeed; resumes at the one that is running; fails with any."""
    return Sequence(name, memory=True)


def reactive_sequence(name: str, _: NodePorts) -> Behaviour:
    """Like `Sequence`, but ticks all from the first one each time: conditions that no longer hold stop the rest."""
    return Sequence(name, memory=False)


def fallback(name: str, _: NodePorts) -> Behaviour:
    """Ticks one child after the other until one succeeds; resumes at the one that is running; fails if all fail."""
    return Selector(name, memory=True)


def reactive_fallback(name: str, _: NodePorts) -> Behaviour:
    """Like `Fallback`, but ticks all from the first one each time: one that succeeds stops those after it."""
    return Selector(name, memory=False)


CONTROL_NODES: Catalog = {
    "Sequence": _control(sequence),
    "ReactiveSequence": _control(reactive_sequence),
    "Fallback": _control(fallback),
    "ReactiveFallback": _control(reactive_fallback),
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
