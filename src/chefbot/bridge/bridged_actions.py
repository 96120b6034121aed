"""Actions of the loop on the wire: what travels as topics within a process are services and topics outside."""

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
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.msgs.validity import InvalidMessageError, check
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import WireNode
from chefbot.runtime.actions import failed_result

Say = Callable[[str, Message], None]
PATIENCE = 3.0
"""Seconds for which a goal waits for its server to appear."""
UNREACHABLE = 9000
"""Error code of a result where the server could not be reached (nav2_msgs/NavigateToPose: unknown)."""
WITHOUT_REASON = 9001
"""Of one that was given up with no error code: Nav2 does so when another goal takes its place."""
DROPPED = "{} gave the goal up and did not say why; another goal may have taken its place."


class ServedAction:
    """A node of the loop serves it: goals from outside become the loop's, its answers go out."""

    def __init__(self, node: WireNode, name: str, action: Action[Any, Any, Any], say: Say) -> None:
        self._name, self._action, self._say = name, action, say
        self._refused = node.wire.refused
        self._server = ActionServer(node, name, action, self._take_goal, self._take_cancel)

    def hear(self, part: str, message: Any) -> None:
        """What was said in the loop on `<name>/_action/<part>`."""
        if part == "send_goal":
            self._server.begin(message.goal_id)
        elif part == "feedback":
            self._server.feedback(message.goal_id, message.feedback)
        elif part == "get_result":
            self._server.finish(message.goal_id, message.status, message.result)

    def _take_goal(self, goal_id: UUID, goal: Message) -> bool:
        try:
            check(goal)
        except InvalidMessageError as error:
            self._refused.add(f"goal of /{self._name}: {error}")
            return False
        self._say(f"{self._name}/_action/send_goal", self._action.send_goal(goal_id, goal))
        return True

    def _take_cancel(self, goal_id: UUID) -> bool:
        self._say(f"{self._name}/_action/cancel_goal", CancelGoal_Request(GoalInfo(goal_id)))
        return True


class CalledAction:
    """Nodes of the loop call it and none of them serves it: goals go out, answers become the loop's."""

    def __init__(
        self,
        node: WireNode,
        name: str,
        action: Action[Any, Any, Any],
        say: Say,
        now_ns: Callable[[], int],
    ) -> None:
        self._name, self._action, self._say, self._now_ns = name, action, say, now_ns
        self._client = ActionClient(node, name, action)
        self._early: dict[bytes, bool] = {}

    def hear(self, part: str, message: Any) -> None:
        """What was said in the loop on `<name>/_action/<part>`."""
        if part == "send_goal" and self._client.served:
            self._send(message.goal_id, message.goal)
        elif part == "send_goal":
            self._early[message.goal_id.key] = True
            threading.Thread(
                target=self._send_late, args=(message.goal_id, message.goal), daemon=True
            ).start()
        elif part == "cancel_goal" and self._early.pop(message.goal_info.goal_id.key, False):
            self._tell_end(message.goal_info.goal_id, STATUS_CANCELED, self._action.result())
        elif part == "cancel_goal":
            self._client.cancel(message.goal_info.goal_id)

    def _send(self, goal_id: UUID, goal: Message) -> None:
        handle = self._client.send(goal, partial(self._feedback, goal_id), goal_id)
        handle.outcome.add_done_callback(partial(self._finish, goal_id))

    def _send_late(self, goal_id: UUID, goal: Message) -> None:
        """As soon as there is a server, or in vain after a while: a launch's processes start one after another."""
        until = time.monotonic() + PATIENCE
        while goal_id.key in self._early and not self._client.served and time.monotonic() < until:
            time.sleep(0.02)
        if self._early.pop(goal_id.key, False):
            self._send(goal_id, goal)

    def _feedback(self, goal_id: UUID, feedback: Message) -> None:
        check(feedback)
        self._say(f"{self._name}/_action/feedback", self._action.feedback_message(goal_id, feedback))

    def _finish(self, goal_id: UUID, outcome: Future[tuple[int, Any]]) -> None:
        error = outcome.exception() or _invalid(outcome.result()[1])
        status, result = (
            (STATUS_ABORTED, failed_result(self._action, UNREACHABLE, str(error)))
            if error
            else outcome.result()
        )
        if status not in (STATUS_SUCCEEDED, STATUS_CANCELED) and not getattr(result, "error_code", 1):
            result = failed_result(self._action, WITHOUT_REASON, DROPPED.format(self._name))
        self._tell_end(goal_id, status, result)

    def _tell_end(self, goal_id: UUID, status: int, result: Message) -> None:
        told = self._action.outcome(goal_id, status, Time.of(self._now_ns()), result)
        self._say(f"{self._name}/_action/get_result", told)


def _invalid(result: Message) -> InvalidMessageError | None:
    """What is wrong with a server's result."""
    try:
        check(result)
    except InvalidMessageError as error:
        return error
    return None
