"""Actions of the loop on the wire: what travels as topics within a process are services and topics outside."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any

import msgspec

from chefbot.msgs.action import Action
from chefbot.msgs.action_msgs import STATUS_ABORTED, CancelGoal_Request, GoalInfo
from chefbot.msgs.base import Message
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.wire.action_client import ActionClient
from chefbot.wire.action_server import ActionServer
from chefbot.wire.errors import WireError
from chefbot.wire.node import WireNode
from chefbot.wire.sane import check_finite

Say = Callable[[str, Message], None]
UNREACHABLE = 9000
"""Error code of a result where the server could not be reached (nav2_msgs/NavigateToPose: unknown)."""


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
            check_finite(goal)
        except WireError as error:
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

    def hear(self, part: str, message: Any) -> None:
        """What was said in the loop on `<name>/_action/<part>`."""
        if part == "send_goal":
            goal_id = message.goal_id
            handle = self._client.send(message.goal, partial(self._feedback, goal_id), goal_id)
            handle.outcome.add_done_callback(partial(self._finish, goal_id))
        elif part == "cancel_goal":
            self._client.cancel(message.goal_info.goal_id)

    def _feedback(self, goal_id: UUID, feedback: Message) -> None:
        self._say(f"{self._name}/_action/feedback", self._action.feedback_message(goal_id, feedback))

    def _finish(self, goal_id: UUID, outcome: Future[tuple[int, Any]]) -> None:
        error = outcome.exception()
        status, result = (STATUS_ABORTED, self._failed(error)) if error else outcome.result()
        told = self._action.outcome(goal_id, status, Time.of(self._now_ns()), result)
        self._say(f"{self._name}/_action/get_result", told)

    def _failed(self, error: BaseException) -> Message:
        """A result that says so, as far as its type can."""
        result: Message = self._action.result()
        if {"error_code", "error_msg"} <= set(result.__struct_fields__):
            return msgspec.structs.replace(result, error_code=UNREACHABLE, error_msg=str(error))
        return result
