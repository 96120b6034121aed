"""Actions between nodes, over four topics with ROS 2's names.

    class Navigator(Node):
        navigate_to_pose = serves(NavigateToPose)
        follow_path = calls(FollowPath)

A server is a coroutine `async def on_<port>(self, goal, feedback) -> Result`. A new goal takes the place of
the old one; a cancelled one sees Cancelled at its `await`. A client awaits `call(goal)`; if it is itself
cancelled while it waits, the goal that it gave is cancelled too.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, cast

import msgspec
import numpy as np

from chefbot.msgs.action_msgs import (
    STATUS_ABORTED,
    STATUS_CANCELED,
    STATUS_SUCCEEDED,
    CancelGoal_Request,
    GoalInfo,
)
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.runtime.coroutines import Cancelled, Future, Task
from chefbot.runtime.node import Node, PortSpec

G = TypeVar("G", bound=Message)
FAILED = 9002
"""Error code of a result whose server raised an exception."""
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class Serves(Generic[G, R, F]):
    """The server's end."""

    def __init__(self, node: Node, name: str, action: Action[G, R, F], work: Callable[..., Any]) -> None:
        self._node, self.name, self.action, self._work = node, name, action, work
        self._current: tuple[bytes, Task[R]] | None = None
        self.replacing = False
        """True while a goal is cancelled because the next one is there: no need to stand still for it."""
        node.listen(f"{name}/_action/send_goal", self._accept)
        node.listen(f"{name}/_action/cancel_goal", self._cancel)

    @property
    def busy(self) -> bool:
        """Whether a goal is being worked on."""
        return self._current is not None

    def preempt(self) -> None:
        """Give up the goal in hand."""
        if self._current is not None:
            self._current[1].cancel()

    def _accept(self, request: Any) -> None:
        self.replacing = True
        try:
            self.preempt()
        finally:  # whatever the old goal's end may raise, the new one is answered
            self.replacing = False
            self._begin(request)

    def _begin(self, request: Any) -> None:
        goal_id: UUID = request.goal_id

        def feedback(message: F) -> None:
            self._node.speak(f"{self.name}/_action/feedback", self.action.feedback_message(goal_id, message))

        task = Task[R](self._work(request.goal, feedback))
        self._current = (goal_id.key, task)
        self._node.adopt(task)
        task.then(lambda: self._finish(goal_id, task))
        task.start()

    def _cancel(self, request: Any) -> None:
        if self._current is not None and self._current[0] == request.goal_info.goal_id.key:
            self._current[1].cancel()

    def _finish(self, goal_id: UUID, task: Task[R]) -> None:
        if self._current is not None and self._current[1] is task:
            self._current = None
        try:
            result = task.result()
            status = STATUS_ABORTED if getattr(result, "error_code", 0) else STATUS_SUCCEEDED
        except Cancelled:
            result, status = self.action.result(), STATUS_CANCELED
        except Exception as fault:
            result, status = (
                failed_result(self.action, FAILED, f"{self.name} failed: {fault}"),
                STATUS_ABORTED,
            )
        outcome = self.action.outcome(goal_id, status, Time.of(self._node.now_ns), result)
        self._node.speak(f"{self.name}/_action/get_result", outcome)


class Calls(Generic[G, R, F]):
    """The client's end."""

    def __init__(
        self, node: Node, name: str, action: Action[G, R, F], on_feedback: Callable[[F], None] | None
    ):
        self._node, self.name, self.action, self._on_feedback = node, name, action, on_feedback
        self._waiting: dict[bytes, Future[R]] = {}
        self._count = 0
        node.listen(f"{name}/_action/get_result", self._receive)
        if on_feedback is not None:
            node.listen(f"{name}/_action/feedback", self._hear)

    def call(self, goal: G) -> Future[R]:
        """`await` it for the result. Raises Cancelled if somebody else's goal takes its place."""
        self._count += 1
        goal_id = _goal_id(self._node.name, self.name, self._count, self._node.now_ns)
        future: Future[R] = Future(on_cancel=lambda: self._give_up(goal_id))
        self._waiting[goal_id.key] = future
        self._node.speak(f"{self.name}/_action/send_goal", self.action.send_goal(goal_id, goal))
        return future

    def _give_up(self, goal_id: UUID) -> None:
        self._waiting.pop(goal_id.key, None)
        request = CancelGoal_Request(GoalInfo(goal_id, Time.of(self._node.now_ns)))
        self._node.speak(f"{self.name}/_action/cancel_goal", request)

    def _receive(self, outcome: Any) -> None:
        future = self._waiting.pop(outcome.goal_id.key, None)
        if future is None:
            return
        if outcome.status == STATUS_CANCELED:
            future.fail(Cancelled())
        else:
            future.set(outcome.result)

    def _hear(self, message: Any) -> None:
        if message.goal_id.key in self._waiting and self._on_feedback is not None:
            self._on_feedback(message.feedback)


def failed_result(action: Action[G, R, F], code: int, why: str) -> R:
    """A result that says why there is none, as far as its type can."""
    result = action.result()
    if {"error_code", "error_msg"} <= set(result.__struct_fields__):
        return msgspec.structs.replace(result, error_code=code, error_msg=why)
    return result


def serves(action: Action[G, R, F], name: str = "") -> Serves[G, R, F]:
    """Declare a server; its topics begin with the port's name unless `name` is given."""
    return cast(Serves[G, R, F], _ServesSpec(action, name))


def calls(action: Action[G, R, F], name: str = "") -> Calls[G, R, F]:
    """Declare a client; `on_<port>` hears feedback."""
    return cast(Calls[G, R, F], _CallsSpec(action, name))


@dataclass(frozen=True)
class _ServesSpec(PortSpec):
    action: Action[Any, Any, Any]
    name: str

    def bind(self, node: Node, name: str) -> Serves[Any, Any, Any]:
        return Serves(node, node.resolve(self.name or name), self.action, getattr(node, f"on_{name}"))


@dataclass(frozen=True)
class _CallsSpec(PortSpec):
    action: Action[Any, Any, Any]
    name: str

    def bind(self, node: Node, name: str) -> Calls[Any, Any, Any]:
        return Calls(node, node.resolve(self.name or name), self.action, getattr(node, f"on_{name}", None))


def _goal_id(node: str, name: str, count: int, now_ns: int) -> UUID:
    """A name that no other goal has, and the same in every run of the same events."""
    digest = hashlib.sha256(f"{node} {name} {count} {now_ns}".encode()).digest()
    return UUID(np.frombuffer(digest[:16], np.uint8))
