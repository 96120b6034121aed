"""A client of an action: send a goal, hear how it goes, get the result or give it up."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import numpy as np

from chefbot.msgs.action import Action
from chefbot.msgs.action_msgs import CancelGoal, CancelGoal_Request, CancelGoal_Response, GoalInfo
from chefbot.msgs.base import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.wire.node import WireNode
from chefbot.wire.service import FOREVER, NoAnswerError


class RejectedError(Exception):
    """The server does not want this goal."""


class GoalHandle:
    """A goal on its way. `outcome` gives (status, result); it fails with RejectedError or NoAnswerError."""

    def __init__(self, client: ActionClient, goal_id: UUID) -> None:
        self.goal_id = goal_id
        self.outcome: Future[tuple[int, Any]] = Future()
        self._client = client

    def cancel(self) -> Future[CancelGoal_Response]:
        """Ask the server to give it up; the outcome then says whether it did."""
        return self._client.cancel(self.goal_id)


class ActionClient:
    """Calls the action `name`. Any thread; `on_feedback` runs in Zenoh's."""

    def __init__(self, node: WireNode, name: str, action: Action[Any, Any, Any]) -> None:
        self.action = action
        self._listeners: dict[bytes, Callable[[Any], None]] = {}
        self._lock = threading.Lock()
        base = f"{name}/_action/"
        self._send = node.client(base + "send_goal", action.send_goal_service)
        self._get = node.client(base + "get_result", action.get_result_service, timeout=FOREVER)
        self._cancel = node.client(base + "cancel_goal", CancelGoal)
        node.subscription(base + "feedback", action.feedback_message, self._hear)

    @property
    def served(self) -> bool:
        """Whether somebody serves it."""
        return self._send.served

    def send(
        self, goal: Message, on_feedback: Callable[[Any], None] | None = None, goal_id: UUID | None = None
    ) -> GoalHandle:
        """Give the goal; returns at once."""
        handle = GoalHandle(self, goal_id or new_goal_id())
        if on_feedback is not None:
            with self._lock:
                self._listeners[handle.goal_id.key] = on_feedback
        handle.outcome.add_done_callback(lambda _: self._forget(handle.goal_id))
        sent = self._send.start(self.action.send_goal(handle.goal_id, goal))
        sent.add_done_callback(lambda future: self._sent(future, handle))
        return handle

    def cancel(self, goal_id: UUID) -> Future[CancelGoal_Response]:
        """Ask the server to give this goal up."""
        return self._cancel.start(CancelGoal_Request(GoalInfo(goal_id)))

    def _sent(self, future: Future[Any], handle: GoalHandle) -> None:
        error = future.exception()
        if error is not None:
            handle.outcome.set_exception(error)
        elif not future.result().accepted:
            handle.outcome.set_exception(RejectedError("the server does not accept this goal"))
        else:
            request = self.action.get_result_service.request(handle.goal_id)
            self._get.start(request).add_done_callback(lambda got: _pass_on(got, handle.outcome))

    def _hear(self, message: Any) -> None:
        with self._lock:
            listener = self._listeners.get(message.goal_id.key)
        if listener is not None:
            listener(message.feedback)

    def _forget(self, goal_id: UUID) -> None:
        with self._lock:
            self._listeners.pop(goal_id.key, None)


def new_goal_id() -> UUID:
    """A name that no other goal has."""
    return UUID(np.frombuffer(uuid.uuid4().bytes, np.uint8))


def _pass_on(got: Future[Any], outcome: Future[tuple[int, Any]]) -> None:
    error = got.exception()
    if error is None:
        outcome.set_result((got.result().status, got.result().result))
    else:
        outcome.set_exception(error if isinstance(error, NoAnswerError) else NoAnswerError(str(error)))
