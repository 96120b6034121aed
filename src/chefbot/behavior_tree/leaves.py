"""Base classes of the leaves of a behavior tree: actions that take time, and conditions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import Protocol

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from chefbot.behavior_tree.blackboard import NodePorts


class Pending(Protocol):
    """The result of something that takes time, such as the future of an action client."""

    done: bool

    def result(self) -> object:
        """Return the result once it is done, or raise the exception that ended it."""

    def discard(self) -> None:
        """Cancel it: the result is no longer needed."""

    def add_done_callback(self, waiter: Callable[[], None]) -> None:
        """Call `waiter` when it is done."""


class Leaf(Behaviour):
    """Base class of a leaf with ports."""

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name)
        self.ports = ports


class ConditionLeaf(Leaf):
    """Base class of a leaf that succeeds while `holds` is true."""

    @abstractmethod
    def holds(self) -> bool:
        """Return whether the condition is true."""

    def update(self) -> Status:
        """Return SUCCESS if the condition holds, else FAILURE."""
        return Status.SUCCESS if self.holds() else Status.FAILURE


class ActionLeaf(Leaf):
    """Base class of a leaf that starts an action at its first tick and is running until that is done."""

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self.pending: Pending | None = None

    @abstractmethod
    def begin(self) -> Pending | None:
        """Begin the action; None if it is done at once."""

    @abstractmethod
    def finish(self, result: object) -> Status:
        """Return the status that the result stands for, and write the outputs."""

    def initialise(self) -> None:
        """Begin the action at the first tick."""
        self.feedback_message = ""
        self.pending = self.begin()

    def update(self) -> Status:
        """Return RUNNING until the action is done."""
        if self.pending is None:
            return self.finish(None)
        return self.finish(self.pending.result()) if self.pending.done else Status.RUNNING

    def terminate(self, new_status: Status) -> None:
        """Cancel the action if it is not done."""
        if new_status is Status.INVALID and self.pending is not None and not self.pending.done:
            self.pending.discard()
        self.pending = None
