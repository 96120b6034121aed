"""Control nodes of BehaviorTree.CPP and Nav2, on py_trees.

Sequences and fallbacks are those of py_trees: with memory they resume at the child that is running, without it they
are the reactive ones. The others have the semantics, names and ports of nav2_behavior_tree.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite

from chefbot.behavior_tree.blackboard import NodePorts


def halt(child: Behaviour) -> None:
    """Stop a child, and reset its status: its next tick begins from the start."""
    if child.status is not Status.INVALID:
        child.stop(Status.INVALID)


class ControlNode(Composite):
    """Base class: `decide` ticks children and returns the status of the node.

    A node that is stopped while it is running calls `reset`.
    """

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name)
        self.ports = ports

    def reset(self) -> None:
        """Begin with the first child again."""

    @abstractmethod
    def decide(self) -> Status:
        """Tick children and return the status of the node."""

    def tick(self) -> Iterator[Behaviour]:
        """Tick the children whose turn it is."""
        self.status = Status.RUNNING
        status = self.decide()
        if status is not Status.RUNNING:
            self.stop(status)
        yield self

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Stop the node, and with `INVALID` its children."""
        if new_status is Status.INVALID and self.status is Status.RUNNING:
            self.reset()
        super().stop(new_status)

    def _tick_child(self, index: int) -> Status:
        self.current_child = self.children[index]
        self.children[index].tick_once()
        return self.children[index].status

    def _halt_children(self) -> None:
        for child in self.children:
            halt(child)


class PipelineSequence(ControlNode):
    """Ticks all children up to the one that is running, also those that have succeeded; fails with any child."""

    _last = 0

    def reset(self) -> None:
        """Begin with the first child again."""
        self._last = 0

    def decide(self) -> Status:
        """Return RUNNING while the last child that was reached is running."""
        for index in range(len(self.children)):
            status = self._tick_child(index)
            if status is Status.RUNNING and index >= self._last:
                self._last = index
                return Status.RUNNING
            if status is Status.FAILURE:
                return self._finish(Status.FAILURE)
        return self._finish(Status.SUCCESS)

    def _finish(self, status: Status) -> Status:
        self._halt_children()
        self._last = 0
        return status


class RecoveryNode(ControlNode):
    """Ticks the first child; when it fails, the second one, and after its success the first one again.

    It fails when the second child fails, or after `number_of_retries` recoveries.
    """

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self.retries = 0
        """Recoveries since the node began."""
        self._recovering = False

    def reset(self) -> None:
        """Begin with the first child again, and without recoveries."""
        self.retries, self._recovering = 0, False

    def decide(self) -> Status:
        """Return SUCCESS or RUNNING as the first child does, FAILURE if no recovery is left."""
        for _ in range(2 * int(self.ports.number("number_of_retries")) + 2):
            status = self._tick_child(int(self._recovering))
            if status is Status.RUNNING:
                return Status.RUNNING
            if self._recovering:
                halt(self.children[1])
                if status is Status.FAILURE:
                    return self._finish(Status.FAILURE)
                self.retries, self._recovering = self.retries + 1, False
            elif status is Status.SUCCESS or self.retries >= int(self.ports.number("number_of_retries")):
                return self._finish(status)
            else:
                halt(self.children[0])
                self._recovering = True
        return self._finish(Status.FAILURE)

    def _finish(self, status: Status) -> Status:
        self._halt_children()
        self.reset()
        return status


class RoundRobin(ControlNode):
    """Ticks one child until it ends, and the next one at the next activation; fails if all children fail in a row."""

    _index = _failed = 0

    def reset(self) -> None:
        """Begin with the first child again."""
        self._index = self._failed = 0

    def decide(self) -> Status:
        """Return the status of the child whose turn it is; after a failure the next child has its turn."""
        while self._failed < len(self.children):
            status = self._tick_child(self._index)
            if status is Status.RUNNING:
                return Status.RUNNING
            self._index = (self._index + 1) % len(self.children)
            if status is Status.SUCCESS:
                self._failed = 0
                self._halt_children()
                return Status.SUCCESS
            self._failed += 1
        self._halt_children()
        self.reset()
        return Status.FAILURE


class Parallel(ControlNode):
    """Ticks all children that have not ended; succeeds with `success_count` of them, fails with `failure_count`.

    It also fails as soon as too many have failed for a success. A count of -1 stands for all children.
    """

    def decide(self) -> Status:
        """Return the status that the counts of ended children give."""
        for index, child in enumerate(self.children):
            if child.status in (Status.INVALID, Status.RUNNING):
                self._tick_child(index)
        succeeded = sum(child.status is Status.SUCCESS for child in self.children)
        failed = sum(child.status is Status.FAILURE for child in self.children)
        needed = self._count("success_count")
        if succeeded >= needed:
            return self._finish(Status.SUCCESS)
        if failed >= self._count("failure_count") or len(self.children) - failed < needed:
            return self._finish(Status.FAILURE)
        return Status.RUNNING

    def _count(self, port: str) -> int:
        count = int(self.ports.number(port))
        return len(self.children) if count < 0 else count

    def _finish(self, status: Status) -> Status:
        self._halt_children()
        return status
