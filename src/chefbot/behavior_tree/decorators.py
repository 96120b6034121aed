"""Decorators of BehaviorTree.CPP and Nav2. Their times are those of the blackboard's clock."""

from __future__ import annotations

from py_trees.common import Status

from chefbot.behavior_tree.blackboard import NodePorts
from chefbot.behavior_tree.controls import ControlNode, halt


class Decorator(ControlNode):
    """Base class of a node with one child."""

    def _tick_only_child(self) -> Status:
        """Tick the child and return its status."""
        return self._tick_child(0)

    def _restart_child(self) -> None:
        halt(self.children[0])


class Inverter(Decorator):
    """Succeeds if its child fails, and fails if it succeeds."""

    def decide(self) -> Status:
        """Return the opposite of the child's status."""
        opposite = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}
        status = self._tick_only_child()
        return opposite.get(status, status)


class ForceSuccess(Decorator):
    """Succeeds when its child has ended."""

    def decide(self) -> Status:
        """Return SUCCESS unless the child is running."""
        return Status.RUNNING if self._tick_only_child() is Status.RUNNING else Status.SUCCESS


class ForceFailure(Decorator):
    """Fails when its child has ended."""

    def decide(self) -> Status:
        """Return FAILURE unless the child is running."""
        return Status.RUNNING if self._tick_only_child() is Status.RUNNING else Status.FAILURE


class KeepRunningUntilFailure(Decorator):
    """Begins its child again after each success, and fails with it."""

    def decide(self) -> Status:
        """Return RUNNING until the child fails."""
        status = self._tick_only_child()
        if status is Status.SUCCESS:
            self._restart_child()
        return Status.FAILURE if status is Status.FAILURE else Status.RUNNING


class CountingDecorator(Decorator):
    """Base class of a decorator that restarts its child a number of times; -1 for no limit.

    With 0 it ends at once, as after the last restart, and the child is not ticked.
    """

    _port = ""
    _end, _used_up = Status.FAILURE, Status.SUCCESS
    _count = 0

    def reset(self) -> None:
        """Set the count of the child's runs to zero."""
        self._count = 0

    def decide(self) -> Status:
        """Return `_end` as soon as the child does, else the child's status once it has ended often enough."""
        limit = int(self.ports.number(self._port))
        if limit == 0:
            self._restart_child()
            return self._used_up
        status = self._tick_only_child()
        if status is Status.RUNNING:
            return Status.RUNNING
        self._restart_child()
        self._count += 1
        if status is self._end or (0 <= limit <= self._count):
            self._count = 0
            return status
        return Status.RUNNING


class Repeat(CountingDecorator):
    """Repeats its child `num_cycles` times, as long as it succeeds."""

    _port = "num_cycles"


class RetryUntilSuccessful(CountingDecorator):
    """Tries its child up to `num_attempts` times, until it succeeds."""

    _port = "num_attempts"
    _end, _used_up = Status.SUCCESS, Status.FAILURE


class TimedDecorator(Decorator):
    """Base class of a decorator that measures the time since it began."""

    _began_ns: int | None = None

    def reset(self) -> None:
        """Measure from the next tick on."""
        self._began_ns = None

    def _elapsed(self) -> float:
        """Return the time since the node began, s."""
        now_ns = self.ports.blackboard.now_ns
        if self._began_ns is None:
            self._began_ns = now_ns
        return (now_ns - self._began_ns) / 1e9


class Timeout(TimedDecorator):
    """Fails if its child has not ended after `msec` milliseconds."""

    def decide(self) -> Status:
        """Return the child's status while there is time."""
        elapsed, status = self._elapsed(), self._tick_only_child()
        if status is Status.RUNNING and 1e3 * elapsed >= self.ports.number("msec"):
            self._restart_child()
            status = Status.FAILURE
        if status is not Status.RUNNING:
            self.reset()
        return status


class Delay(TimedDecorator):
    """Begins its child after `delay_msec` milliseconds."""

    def decide(self) -> Status:
        """Return RUNNING during the delay, then the child's status."""
        if 1e3 * self._elapsed() < self.ports.number("delay_msec"):
            return Status.RUNNING
        status = self._tick_only_child()
        if status is not Status.RUNNING:
            self.reset()
        return status


class RateController(Decorator):
    """Begins its child at most `hz` times a second; is running in between, also after the child's success."""

    def __init__(self, name: str, ports: NodePorts) -> None:
        super().__init__(name, ports)
        self._succeeded_ns: int | None = None

    def decide(self) -> Status:
        """Return the child's status if it is ticked, else RUNNING."""
        child, now_ns = self.children[0], self.ports.blackboard.now_ns
        if child.status is Status.INVALID:
            self._succeeded_ns = None  # it begins for the first time, or again after a stop
        due = self._succeeded_ns is None or now_ns - self._succeeded_ns >= 1e9 / self.ports.number("hz")
        if child.status is not Status.RUNNING and not due:
            return Status.RUNNING
        status = self._tick_only_child()
        if status is Status.SUCCESS:
            self._succeeded_ns = now_ns
        return status


class SingleTrigger(Decorator):
    """Runs its child once, and fails from then on until it is stopped."""

    _triggered = False

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Stop the node; with `INVALID` the child may run again."""
        self._triggered = self._triggered and new_status is not Status.INVALID
        super().stop(new_status)

    def decide(self) -> Status:
        """Return the child's status the first time."""
        if self._triggered:
            return Status.FAILURE
        status = self._tick_only_child()
        self._triggered = status is not Status.RUNNING
        return status
