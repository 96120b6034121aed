"""Action servers and clients of nodes, over four topics with ROS 2's names.

    class Navigator(Node):
        navigate_to_pose = serves(NavigateToPose)
        follow_path = calls(FollowPath)

A server executes the coroutine `async def on_<port>(self, goal, feedback) -> Result`. A new goal preempts
the current one; a cancelled goal's coroutine gets Cancelled raised at its `await`. A client awaits
`call(goal)`; if the client is cancelled while it waits, its goal is cancelled too.
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
SERVER_EXCEPTION = 9002
"""Error code of the result if the server's coroutine raised an exception."""
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class ActionServerPort(Generic[G, R, F]):
    """An action server that executes one goal at a time; a new goal preempts the current one."""

    def __init__(
        self, node: Node, name: str, action: Action[G, R, F], execute_callback: Callable[..., Any]
    ) -> None:
        self._node, self.name, self.action, self._execute_callback = node, name, action, execute_callback
        self._current: tuple[bytes, Task[R]] | None = None
        self.preempting = False
        """True while a goal is cancelled in favour of the next one, so the robot need not stop in between."""
        node.subscribe(f"{name}/_action/send_goal", self._accept)
        node.subscribe(f"{name}/_action/cancel_goal", self._cancel)

    @property
    def busy(self) -> bool:
        """Whether a goal is being executed."""
        return self._current is not None

    @property
    def goal_keys(self) -> list[bytes]:
        """Key of the id of the goal that is being executed, if there is one."""
        return [self._current[0]] if self._current is not None else []

    def preempt(self) -> None:
        """Cancel the current goal, if there is one."""
        if self._current is not None:
            self._current[1].cancel()

    def _accept(self, request: Any) -> None:
        self.preempting = True
        try:
            self.preempt()
        finally:  # the new goal is executed even if the cancelled one raises
            self.preempting = False
            self._execute(request)

    def _execute(self, request: Any) -> None:
        goal_id: UUID = request.goal_id

        def feedback(message: F) -> None:
            self._node.publish(
                f"{self.name}/_action/feedback", self.action.feedback_message(goal_id, message)
            )

        task = Task[R](self._execute_callback(request.goal, feedback))
        self._current = (goal_id.key, task)
        self._node.adopt(task)
        task.add_done_callback(lambda: self._finish(goal_id, task))
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
        except Exception as error:
            status = STATUS_ABORTED
            result = failed_result(self.action, SERVER_EXCEPTION, f"{self.name} failed: {error}")
        outcome = self.action.outcome(goal_id, status, Time.of(self._node.now_ns), result)
        self._node.publish(f"{self.name}/_action/get_result", outcome)


class ActionClientPort(Generic[G, R, F]):
    """An action client that sends goals and awaits their results."""

    def __init__(
        self, node: Node, name: str, action: Action[G, R, F], on_feedback: Callable[[F], None] | None
    ):
        self._node, self.name, self.action, self._on_feedback = node, name, action, on_feedback
        self._waiting: dict[bytes, Future[R]] = {}
        self._count = 0
        node.subscribe(f"{name}/_action/get_result", self._receive_result)
        if on_feedback is not None:
            node.subscribe(f"{name}/_action/feedback", self._receive_feedback)

    @property
    def goal_keys(self) -> list[bytes]:
        """Keys of the ids of the goals whose results are awaited."""
        return list(self._waiting)

    def call(self, goal: G) -> Future[R]:
        """Send a goal and return a future of its result.

        The future raises Cancelled if the goal is cancelled or preempted by another client's goal.
        """
        self._count += 1
        goal_id = _goal_id(self._node.name, self.name, self._count, self._node.now_ns)
        future: Future[R] = Future(on_cancel=lambda: self._cancel_goal(goal_id))
        self._waiting[goal_id.key] = future
        self._node.publish(f"{self.name}/_action/send_goal", self.action.send_goal(goal_id, goal))
        return future

    def _cancel_goal(self, goal_id: UUID) -> None:
        self._waiting.pop(goal_id.key, None)
        request = CancelGoal_Request(GoalInfo(goal_id, Time.of(self._node.now_ns)))
        self._node.publish(f"{self.name}/_action/cancel_goal", request)

    def _receive_result(self, outcome: Any) -> None:
        future = self._waiting.pop(outcome.goal_id.key, None)
        if future is None:
            return
        if outcome.status == STATUS_CANCELED:
            future.set_exception(Cancelled())
        else:
            future.set_result(outcome.result)

    def _receive_feedback(self, message: Any) -> None:
        if message.goal_id.key in self._waiting and self._on_feedback is not None:
            self._on_feedback(message.feedback)


def failed_result(action: Action[G, R, F], code: int, message: str) -> R:
    """Return an empty result with error code and message, as far as its type has these fields."""
    result = action.result()
    if {"error_code", "error_msg"} <= set(result.__struct_fields__):
        return msgspec.structs.replace(result, error_code=code, error_msg=message)
    return result


def action_server(action: Action[G, R, F], name: str = "") -> ActionServerPort[G, R, F]:
    """Declare an action server; its topics begin with the port's name unless `name` is given."""
    return cast(ActionServerPort[G, R, F], _ServesSpec(action, name))


def action_client(action: Action[G, R, F], name: str = "") -> ActionClientPort[G, R, F]:
    """Declare an action client; the method `on_<port>`, if there is one, receives feedback."""
    return cast(ActionClientPort[G, R, F], _CallsSpec(action, name))


def served_actions(kind: type[Node]) -> list[str]:
    """Return the names of the actions that nodes of this class serve, before remapping."""
    specs = {name: getattr(kind, name) for name in dir(kind)}
    return [spec.name or name for name, spec in specs.items() if isinstance(spec, _ServesSpec)]


@dataclass(frozen=True)
class _ServesSpec(PortSpec):
    action: Action[Any, Any, Any]
    name: str

    def bind(self, node: Node, name: str) -> ActionServerPort[Any, Any, Any]:
        return ActionServerPort(
            node, node.resolve(self.name or name), self.action, getattr(node, f"on_{name}")
        )


@dataclass(frozen=True)
class _CallsSpec(PortSpec):
    action: Action[Any, Any, Any]
    name: str

    def bind(self, node: Node, name: str) -> ActionClientPort[Any, Any, Any]:
        return ActionClientPort(
            node, node.resolve(self.name or name), self.action, getattr(node, f"on_{name}", None)
        )


def _goal_id(node: str, name: str, count: int, now_ns: int) -> UUID:
    """Return a unique goal ID that is the same in every run with the same events."""
    digest = hashlib.sha256(f"{node} {name} {count} {now_ns}".encode()).digest()
    return UUID(np.frombuffer(digest[:16], np.uint8))
