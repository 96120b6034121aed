"""Actions of the loop on the wire: topics within a process are services and topics on the ROS 2 graph."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

from chefbot.msgs.action_msgs import (
    STATUS_ABORTED,
    STATUS_CANCELED,
    STATUS_SUCCEEDED,
    CancelGoal_Request,
    GoalInfo,
)
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.errors import InvalidMessageError
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.msgs.validity import check
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import RmwNode
from chefbot.runtime.actions import failed_result

Publish = Callable[[str, Message], None]
SERVER_TIMEOUT = 3.0
"""Time that a goal waits for its action server to appear, s."""
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


class ActionClientBridge:
    """An action that nodes of the loop call but none serves: goals are sent, responses enter the loop."""

    def __init__(
        self,
        node: RmwNode,
        name: str,
        action: Action[Any, Any, Any],
        publish: Publish,
        now_ns: Callable[[], int],
    ) -> None:
        self._name, self._action, self._publish, self._now_ns = name, action, publish, now_ns
        self._client = ActionClient(node, name, action)
        self._waiting: dict[bytes, bool] = {}

    def forward(self, part: str, message: Any) -> None:
        """Forward a message that was published in the loop on `<name>/_action/<part>`."""
        if part == "send_goal" and self._client.served:
            self._send(message.goal_id, message.goal)
        elif part == "send_goal":
            self._waiting[message.goal_id.key] = True
            threading.Thread(
                target=self._send_when_served, args=(message.goal_id, message.goal), daemon=True
            ).start()
        elif part == "cancel_goal" and self._waiting.pop(message.goal_info.goal_id.key, False):
            self._publish_result(message.goal_info.goal_id, STATUS_CANCELED, self._action.result())
        elif part == "cancel_goal":
            self._client.cancel_goal_async(message.goal_info.goal_id)

    def _send(self, goal_id: UUID, goal: Message) -> None:
        handle = self._client.send_goal_async(goal, partial(self._feedback, goal_id), goal_id)
        handle.result.add_done_callback(partial(self._finish, goal_id))

    def _send_when_served(self, goal_id: UUID, goal: Message) -> None:
        """Send the goal once a server is there, or after a timeout.

        The processes of a launch start one after another.
        """
        deadline = time.monotonic() + SERVER_TIMEOUT
        while goal_id.key in self._waiting and not self._client.served and time.monotonic() < deadline:
            time.sleep(0.02)
        if self._waiting.pop(goal_id.key, False):
            self._send(goal_id, goal)

    def _feedback(self, goal_id: UUID, feedback: Message) -> None:
        check(feedback)
        self._publish(f"{self._name}/_action/feedback", self._action.feedback_message(goal_id, feedback))

    def _finish(self, goal_id: UUID, outcome: Future[tuple[int, Any]]) -> None:
        error = outcome.exception() or _validation_error(outcome.result()[1])
        if error:
            status, result = STATUS_ABORTED, failed_result(self._action, SERVER_UNREACHABLE, str(error))
        else:
            status, result = outcome.result()
        if status not in (STATUS_SUCCEEDED, STATUS_CANCELED) and not getattr(result, "error_code", 1):
            result = failed_result(self._action, ABORTED_WITHOUT_REASON, NO_REASON_TEXT.format(self._name))
        self._publish_result(goal_id, status, result)

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
