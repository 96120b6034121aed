"""Actions of the loop on the wire: topics within a process are services and topics on the ROS 2 graph."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, NamedTuple

from chefbot.msgs.action_msgs import (
    STATUS_ABORTED,
    STATUS_CANCELED,
    STATUS_SUCCEEDED,
    CancelGoal_Request,
    GoalInfo,
)
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.msgs.validity import check
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import RmwNode
from chefbot.runtime.actions import failed_result

Publish = Callable[[str, Message], None]
SERVER_TIMEOUT = 3.0
"""Time that a goal waits for its action server to appear, s; unlimited while a process of the launch starts."""
POLL_PERIOD = 0.02
"""Period at which a waiting goal looks for its server, s."""
SERVER_UNREACHABLE = 9000
"""Error code of the result when the server could not be reached (nav2_msgs/NavigateToPose: unknown)."""
ABORTED_WITHOUT_REASON = 9001
"""Error code of the result of a goal that was aborted without one: Nav2 does so when a goal is preempted."""
NO_REASON_TEXT = "{} aborted the goal without an error code; another goal may have preempted it."


class ActionServerBridge:
    """An action served by a node of the loop: external goals enter the loop, its responses are sent."""

    def __init__(self, node: RmwNode, name: str, action: Action[Any, Any, Any], publish: Publish) -> None:
        self._name, self._action, self._publish = name, action, publish
        self._errors = node.wire.rejected
        self._server = ActionServer(node, name, action, self._on_goal, self._on_cancel)

    def forward(self, part: str, message: Any) -> None:
        """Forward a message that was published in the loop on `<name>/_action/<part>`."""
        if part == "send_goal":
            self._server.execute(message.goal_id)
        elif part == "feedback":
            self._server.publish_feedback(message.goal_id, message.feedback)
        elif part == "get_result":
            self._server.finish(message.goal_id, message.status, message.result)

    def _on_goal(self, goal_id: UUID, goal: Message) -> bool:
        try:
            check(goal)
        except InvalidMessageError as error:
            self._errors.add(f"goal of /{self._name}: {error}")
            return False
        self._publish(f"{self._name}/_action/send_goal", self._action.send_goal(goal_id, goal))
        return True

    def _on_cancel(self, goal_id: UUID) -> bool:
        self._publish(f"{self._name}/_action/cancel_goal", CancelGoal_Request(GoalInfo(goal_id)))
        return True


class _WaitingGoal(NamedTuple):
    goal_id: UUID
    goal: Message
    deadline: float
    """Monotonic time at which it is sent even without a server, s."""


class ActionClientBridge:
    """An action that nodes of the loop call but none serves: goals are sent, responses enter the loop.

    `server_starts`: a node in another process of the launch serves the action. Until its server has been found
    once, goals wait for it without a time limit: on a busy computer processes may take minutes to start.
    """

    def __init__(
        self,
        node: RmwNode,
        name: str,
        action: Action[Any, Any, Any],
        publish: Publish,
        now_ns: Callable[[], int],
        *,
        server_starts: bool = False,
    ) -> None:
        self._name, self._action, self._publish, self._now_ns = name, action, publish, now_ns
        self._client = ActionClient(node, name, action)
        self._server_starts = server_starts
        self._waiting: dict[bytes, _WaitingGoal] = {}
        """Goals that wait for a server, by the key of their id, in the order in which they are sent."""
        self._polling = False
        self._lock = threading.Lock()

    def close(self) -> None:
        """Abandon the goals that wait; afterwards the client is not used any more, and its node may be closed."""
        with self._lock:
            self._waiting.clear()

    def forward(self, part: str, message: Any) -> None:
        """Forward a message that was published in the loop on `<name>/_action/<part>`."""
        if part == "send_goal":
            self._send_when_served(message.goal_id, message.goal)
        elif part == "cancel_goal" and self._stop_waiting(message.goal_info.goal_id):
            self._publish_result(message.goal_info.goal_id, STATUS_CANCELED, self._action.result())
        elif part == "cancel_goal":
            self._client.cancel_goal_async(message.goal_info.goal_id)

    def _send_when_served(self, goal_id: UUID, goal: Message) -> None:
        """Send the goal at once if there is a server, else when there is one or after a timeout."""
        deadline = time.monotonic() + SERVER_TIMEOUT
        with self._lock:
            self._waiting[goal_id.key] = _WaitingGoal(goal_id, goal, deadline)
            self._send_ready_goals()
            if self._waiting and not self._polling:
                self._polling = True
                threading.Thread(target=self._poll, name=f"goals of {self._name}", daemon=True).start()

    def _stop_waiting(self, goal_id: UUID) -> bool:
        """Return whether the goal was still waiting for a server."""
        with self._lock:
            return self._waiting.pop(goal_id.key, None) is not None

    def _poll(self) -> None:
        waits = True
        while waits:
            time.sleep(POLL_PERIOD)
            with self._lock:
                self._send_ready_goals()
                waits = self._polling = bool(self._waiting)

    def _send_ready_goals(self) -> None:
        """Send the waiting goals if there is a server, or those whose time is over if none is starting."""
        served = bool(self._waiting) and self._client.served
        self._server_starts = self._server_starts and not served
        for key, waiting in list(self._waiting.items()):
            if served or not (self._server_starts or time.monotonic() < waiting.deadline):
                del self._waiting[key]
                self._send(waiting.goal_id, waiting.goal)

    def _send(self, goal_id: UUID, goal: Message) -> None:
        try:
            handle = self._client.send_goal_async(goal, partial(self._feedback, goal_id), goal_id)
        except CdrError as error:
            self._publish_failure(goal_id, f"the goal of /{self._name} cannot be sent: {error}")
        else:
            handle.result.add_done_callback(partial(self._finish, goal_id))

    def _feedback(self, goal_id: UUID, feedback: Message) -> None:
        check(feedback)
        self._publish(f"{self._name}/_action/feedback", self._action.feedback_message(goal_id, feedback))

    def _finish(self, goal_id: UUID, outcome: Future[tuple[int, Any]]) -> None:
        error = outcome.exception() or _validation_error(outcome.result()[1])
        if error:
            self._publish_failure(goal_id, str(error))
            return
        status, result = outcome.result()
        if status not in (STATUS_SUCCEEDED, STATUS_CANCELED) and not getattr(result, "error_code", 1):
            result = failed_result(self._action, ABORTED_WITHOUT_REASON, NO_REASON_TEXT.format(self._name))
        self._publish_result(goal_id, status, result)

    def _publish_failure(self, goal_id: UUID, reason: str) -> None:
        result = failed_result(self._action, SERVER_UNREACHABLE, reason)
        self._publish_result(goal_id, STATUS_ABORTED, result)

    def _publish_result(self, goal_id: UUID, status: int, result: Message) -> None:
        response = self._action.outcome(goal_id, status, Time.of(self._now_ns()), result)
        self._publish(f"{self._name}/_action/get_result", response)


def _validation_error(result: Message) -> InvalidMessageError | None:
    """Return what is wrong with a server's result, if anything."""
    try:
        check(result)
    except InvalidMessageError as error:
        return error
    return None
