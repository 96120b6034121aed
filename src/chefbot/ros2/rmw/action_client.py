"""A client of an action: send a goal, hear how it goes, get the result or give it up.

A server of another distribution is called in the edition that it has (`msgs.editions`).
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from chefbot.msgs.action_msgs import CancelGoal, CancelGoal_Request, CancelGoal_Response, GoalInfo
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.editions import convert, editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.names import WireType, resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.service import FOREVER, Client, NoAnswerError


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


class _Form(NamedTuple):
    """An edition of the action, and what its server has to have."""

    action: Action[Any, Any, Any]
    send_goal: WireType
    get_result: WireType

    @staticmethod
    def of(action: Action[Any, Any, Any]) -> _Form:
        return _Form(action, WireType.of(action.send_goal_service), WireType.of(action.get_result_service))


class _Calls(NamedTuple):
    """The clients of one edition."""

    form: _Form
    send: Client[Any, Any]
    get: Client[Any, Any]


class ActionClient:
    """Calls the action `name`. Any thread; `on_feedback` runs in Zenoh's."""

    def __init__(self, node: WireNode, name: str, action: Action[Any, Any, Any]) -> None:
        self.action = action
        self._node = node
        self._base = f"{name}/_action/"
        self._forms = [_Form.of(one) for one in (action, *editions(action.ros_name))]
        self._calls: dict[_Form, _Calls] = {}
        self._heard: set[WireType] = set()
        self._listeners: dict[bytes, Callable[[Any], None]] = {}
        self._lock = threading.Lock()
        self._cancel = node.client(self._base + "cancel_goal", CancelGoal)
        self._calls_in(self._forms[0])

    @property
    def served(self) -> bool:
        """Whether somebody serves it, in an edition that we know, and is within reach."""
        form = self._served()
        return form is not None and self._calls_in(form).send.served

    def send(
        self, goal: Message, on_feedback: Callable[[Any], None] | None = None, goal_id: UUID | None = None
    ) -> GoalHandle:
        """Give the goal; returns at once."""
        handle = GoalHandle(self, goal_id or new_goal_id())
        if on_feedback is not None:
            with self._lock:
                self._listeners[handle.goal_id.key] = on_feedback
        handle.outcome.add_done_callback(lambda _: self._forget(handle.goal_id))
        calls = self._calls_in(self._served() or self._forms[0])
        action = calls.form.action
        sent = calls.send.start(action.send_goal(handle.goal_id, convert(goal, action.goal)))
        sent.add_done_callback(lambda future: self._sent(future, handle, calls))
        return handle

    def cancel(self, goal_id: UUID) -> Future[CancelGoal_Response]:
        """Ask the server to give this goal up."""
        return self._cancel.start(CancelGoal_Request(GoalInfo(goal_id)))

    def _served(self) -> _Form | None:
        """The newest edition that somebody serves as a whole."""
        services = self._node.wire.graph.services()

        def types(part: str) -> set[WireType]:
            name = resolve(self._base + part, self._node.id.namespace, self._node.full_name)
            return {one.end.type for one in services[name].givers} if name in services else set()

        goals, results = types("send_goal"), types("get_result")
        return next(
            (one for one in self._forms if one.send_goal in goals and one.get_result in results), None
        )

    def _calls_in(self, form: _Form) -> _Calls:
        """Made when they are first needed: what nobody speaks stays off the graph."""
        action, node = form.action, self._node
        with self._lock:
            if form not in self._calls:
                send = node.client(self._base + "send_goal", action.send_goal_service)
                get = node.client(self._base + "get_result", action.get_result_service, timeout=FOREVER)
                self._calls[form] = _Calls(form, send, get)
                told = WireType.of(action.feedback_message)
                if told not in self._heard:
                    self._heard.add(told)
                    node.subscription(self._base + "feedback", action.feedback_message, self._hear)
            return self._calls[form]

    def _sent(self, future: Future[Any], handle: GoalHandle, calls: _Calls) -> None:
        error = future.exception()
        if error is not None:
            handle.outcome.set_exception(error)
        elif not future.result().accepted:
            handle.outcome.set_exception(RejectedError("the server does not accept this goal"))
        else:
            request = calls.form.action.get_result_service.request(handle.goal_id)
            end = partial(_pass_on, handle.outcome, self.action)
            calls.get.start(request).add_done_callback(end)

    def _hear(self, message: Any) -> None:
        with self._lock:
            listener = self._listeners.get(message.goal_id.key)
        if listener is not None:
            listener(convert(message.feedback, self.action.feedback))

    def _forget(self, goal_id: UUID) -> None:
        with self._lock:
            self._listeners.pop(goal_id.key, None)


def new_goal_id() -> UUID:
    """A name that no other goal has."""
    return UUID(np.frombuffer(uuid.uuid4().bytes, np.uint8))


def _pass_on(outcome: Future[tuple[int, Any]], action: Action[Any, Any, Any], got: Future[Any]) -> None:
    error = got.exception()
    if error is None:
        outcome.set_result((got.result().status, convert(got.result().result, action.result)))
    else:
        outcome.set_exception(error if isinstance(error, NoAnswerError) else NoAnswerError(str(error)))
