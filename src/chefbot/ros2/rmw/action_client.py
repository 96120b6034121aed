"""An action client: sends goals, receives feedback, gets results and cancels goals.

A server of another ROS 2 distribution is called with that distribution's version of the action
(`msgs.editions`).
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from chefbot.errors import ChefbotError
from chefbot.msgs.action_msgs import CancelGoal, CancelGoal_Request, CancelGoal_Response, GoalInfo
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.editions import convert, older_editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.names import InterfaceType, resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.service import NO_TIMEOUT, Client, NoResponseError


class GoalRejectedError(ChefbotError):
    """Raised when the action server rejects a goal."""


class GoalHandle:
    """A handle to a goal that was sent to an action server.

    `outcome` resolves to (status, result); it fails with GoalRejectedError or NoResponseError.
    """

    def __init__(self, client: ActionClient, goal_id: UUID) -> None:
        self.goal_id = goal_id
        self.result: Future[tuple[int, Any]] = Future()
        self._client = client

    def cancel(self) -> Future[CancelGoal_Response]:
        """Request cancellation of this goal; `outcome` later reports whether it was canceled."""
        return self._client.cancel_goal_async(self.goal_id)


class _ActionVersion(NamedTuple):
    """One version of the action definition with the service types that its server must offer."""

    action: Action[Any, Any, Any]
    send_goal: InterfaceType
    get_result: InterfaceType

    @staticmethod
    def of(action: Action[Any, Any, Any]) -> _ActionVersion:
        return _ActionVersion(
            action, InterfaceType.of(action.send_goal_service), InterfaceType.of(action.get_result_service)
        )


class _ServiceClients(NamedTuple):
    """The service clients for one version of the action."""

    version: _ActionVersion
    send: Client[Any, Any]
    get: Client[Any, Any]


class ActionClient:
    """A client of the action `name`. Thread-safe; `on_feedback` runs in a Zenoh thread."""

    def __init__(self, node: RmwNode, name: str, action: Action[Any, Any, Any]) -> None:
        self.action = action
        self._node = node
        self._base = f"{name}/_action/"
        self._versions = [
            _ActionVersion.of(version) for version in (action, *older_editions(action.ros_name))
        ]
        self._clients: dict[_ActionVersion, _ServiceClients] = {}
        self._feedback_types: set[InterfaceType] = set()
        self._feedback_callbacks: dict[bytes, Callable[[Any], None]] = {}
        self._lock = threading.Lock()
        self._cancel = node.client(self._base + "cancel_goal", CancelGoal)
        self._clients_for(self._versions[0])

    @property
    def served(self) -> bool:
        """Return whether a server with a known version of the action is reachable."""
        version = self._served_version()
        return version is not None and self._clients_for(version).send.server_is_ready

    def send_goal_async(
        self, goal: Message, on_feedback: Callable[[Any], None] | None = None, goal_id: UUID | None = None
    ) -> GoalHandle:
        """Send a goal to the action server; returns at once.

        `on_feedback` is called in a Zenoh thread with each feedback message of this goal.
        """
        handle = GoalHandle(self, goal_id or new_goal_id())
        if on_feedback is not None:
            with self._lock:
                self._feedback_callbacks[handle.goal_id.key] = on_feedback
        handle.result.add_done_callback(lambda _: self._forget(handle.goal_id))
        clients = self._clients_for(self._served_version() or self._versions[0])
        action = clients.version.action
        sent = clients.send.call_async(action.send_goal(handle.goal_id, convert(goal, action.goal)))
        sent.add_done_callback(lambda future: self._on_goal_response(future, handle, clients))
        return handle

    def cancel_goal_async(self, goal_id: UUID) -> Future[CancelGoal_Response]:
        """Request cancellation of the goal with this id."""
        return self._cancel.call_async(CancelGoal_Request(GoalInfo(goal_id)))

    def _served_version(self) -> _ActionVersion | None:
        """Return the newest version whose goal and result services both have a server."""
        services = self._node.wire.graph.services()

        def types(part: str) -> set[InterfaceType]:
            name = resolve(self._base + part, self._node.id.namespace, self._node.full_name)
            return (
                {endpoint.info.type for endpoint in services[name].providers} if name in services else set()
            )

        goals, results = types("send_goal"), types("get_result")
        return next(
            (
                version
                for version in self._versions
                if version.send_goal in goals and version.get_result in results
            ),
            None,
        )

    def _clients_for(self, version: _ActionVersion) -> _ServiceClients:
        """Return the service clients of a version, created on first use.

        Versions that no server offers thus stay off the graph.
        """
        action, node = version.action, self._node
        with self._lock:
            # The feedback subscription is shared by versions with the same feedback type
            if version not in self._clients:
                send = node.client(self._base + "send_goal", action.send_goal_service)
                get = node.client(self._base + "get_result", action.get_result_service, timeout=NO_TIMEOUT)
                self._clients[version] = _ServiceClients(version, send, get)
                feedback_type = InterfaceType.of(action.feedback_message)
                if feedback_type not in self._feedback_types:
                    self._feedback_types.add(feedback_type)
                    node.subscription(self._base + "feedback", action.feedback_message, self._on_feedback)
            return self._clients[version]

    def _on_goal_response(self, future: Future[Any], handle: GoalHandle, clients: _ServiceClients) -> None:
        error = future.exception()
        if error is not None:
            handle.result.set_exception(error)
        elif not future.result().accepted:
            handle.result.set_exception(GoalRejectedError("the server rejected the goal"))
        else:
            request = clients.version.action.get_result_service.request(handle.goal_id)
            on_result = partial(_forward_result, handle.result, self.action)
            clients.get.call_async(request).add_done_callback(on_result)

    def _on_feedback(self, message: Any) -> None:
        with self._lock:
            callback = self._feedback_callbacks.get(message.goal_id.key)
        if callback is not None:
            callback(convert(message.feedback, self.action.feedback))

    def _forget(self, goal_id: UUID) -> None:
        with self._lock:
            self._feedback_callbacks.pop(goal_id.key, None)


def new_goal_id() -> UUID:
    """Generate a random unique goal id."""
    return UUID(np.frombuffer(uuid.uuid4().bytes, np.uint8))


def _forward_result(
    outcome: Future[tuple[int, Any]], action: Action[Any, Any, Any], response: Future[Any]
) -> None:
    error = response.exception()
    if error is None:
        outcome.set_result((response.result().status, convert(response.result().result, action.result)))
    else:
        outcome.set_exception(error if isinstance(error, NoResponseError) else NoResponseError(str(error)))
