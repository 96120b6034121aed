"""An action server as ROS 2 clients expect it: three services and two topics.

Actions that other distributions define differently (`msgs.editions`) are also served in those versions.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from chefbot.msgs.action_msgs import (
    CANCEL_GOAL_TERMINATED,
    CANCEL_NONE,
    CANCEL_REJECTED,
    CANCEL_UNKNOWN_GOAL,
    STATUS_ABORTED,
    STATUS_ACCEPTED,
    STATUS_CANCELED,
    STATUS_CANCELING,
    STATUS_EXECUTING,
    STATUS_SUCCEEDED,
    STATUS_UNKNOWN,
    CancelGoal,
    CancelGoal_Response,
    GoalInfo,
    GoalStatus,
    GoalStatusArray,
)
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.definition import type_hash
from chefbot.msgs.idl.editions import convert, older_editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.service import ServiceCall

ActionVersion = Action[Any, Any, Any]
TERMINAL_STATES = (STATUS_SUCCEEDED, STATUS_CANCELED, STATUS_ABORTED)
MAX_FINISHED_GOALS = 16
"""Number of finished goals whose results can still be requested."""
CANCELABLE = (STATUS_ACCEPTED, STATUS_EXECUTING)
OnGoal = Callable[[UUID, Any], bool]
OnCancel = Callable[[UUID], bool]


class _Goal:
    """A goal with its status, its result and the pending result requests."""

    def __init__(self, info: GoalInfo) -> None:
        self.info = info
        self.status = STATUS_ACCEPTED
        self.result: Message | None = None
        self.pending: list[Callable[[int, Message], None]] = []


class ActionServer:
    """A server of the action `name`.

    `on_goal(goal_id, goal)` returns whether the goal is accepted, `on_cancel(goal_id)` whether it will be
    canceled; both run in a Zenoh thread and must return at once. After that, call `feedback` and finally
    `finish`, from any thread.
    """

    def __init__(
        self, node: RmwNode, name: str, action: Action[Any, Any, Any], on_goal: OnGoal, on_cancel: OnCancel
    ) -> None:
        self.action = action
        self._on_goal, self._on_cancel = on_goal, on_cancel
        self._goals: dict[bytes, _Goal] = {}
        self._lock = threading.RLock()
        base = f"{name}/_action/"
        versions = (action, *older_editions(action.ros_name))
        self._feedback = [
            (
                version.feedback,
                node.publisher(base + "feedback", version.feedback_message),
                version.feedback_message,
            )
            for version in _distinct(versions, lambda version: type_hash(version.feedback_message))
        ]
        self._status = node.publisher(base + "status", GoalStatusArray, TRANSIENT_LOCAL_QOS)
        for version in _distinct(versions, lambda version: version.send_goal_service.type_hash):
            node.server(base + "send_goal", version.send_goal_service, partial(self._send_goal, version))
        for version in _distinct(versions, lambda version: version.get_result_service.type_hash):
            node.server(base + "get_result", version.get_result_service, partial(self._get_result, version))
        node.server(base + "cancel_goal", CancelGoal, self._cancel_goal)

    def publish_feedback(self, goal_id: UUID, feedback: Message) -> None:
        """Publish feedback on a goal in every version of the action."""
        for kind, publisher, wrap in self._feedback:
            publisher.publish(wrap(goal_id, convert(feedback, kind)))

    def execute(self, goal_id: UUID) -> None:
        """Mark a goal as executing and publish its status.

        Goals that did not come over the network can be marked too, so that other nodes see them.
        """
        with self._lock:
            self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now()))).status = STATUS_EXECUTING
        self._publish_status()

    def finish(self, goal_id: UUID, status: int, result: Message) -> None:
        """Set the final status (succeeded, canceled or aborted) and result of a goal.

        Pending result requests are answered.
        """
        with self._lock:
            goal = self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now())))
            goal.status, goal.result = status, result
            pending, goal.pending = goal.pending, []
            self._prune_finished()
        for respond in pending:
            respond(status, result)
        self._publish_status()

    def _send_goal(self, version: ActionVersion, call: ServiceCall[Any, Any]) -> None:
        goal_id: UUID = call.request.goal_id
        with self._lock:
            # The id is reserved before the callback, which runs without the lock
            new = goal_id.key not in self._goals
            info = self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now()))).info
        accepted = new and self._on_goal(goal_id, convert(call.request.goal, self.action.goal))
        if new and not accepted:
            with self._lock:
                del self._goals[goal_id.key]
        call.respond(version.send_goal_service.response(accepted, info.stamp))
        self._publish_status()

    def _get_result(self, version: ActionVersion, call: ServiceCall[Any, Any]) -> None:
        def answer(status: int, result: Message) -> None:
            call.respond(version.get_result_service.response(status, convert(result, version.result)))

        with self._lock:
            goal = self._goals.get(call.request.goal_id.key)
            if goal is not None and goal.result is None:
                goal.pending.append(answer)
                return
        if goal is None or goal.result is None:
            answer(STATUS_UNKNOWN, self.action.result())
        else:
            answer(goal.status, goal.result)

    def _cancel_goal(self, call: ServiceCall[Any, Any]) -> None:
        """Handle a cancel request with the rules of rcl_action (`rcl_action_process_cancel_request`)."""
        requested: GoalInfo = call.request.goal_info
        with self._lock:
            matching = [goal for goal in self._goals.values() if _matches(requested, goal)]
            exists = requested.goal_id.key in self._goals
        # The callback decides for each goal, without the lock
        canceling = [goal for goal in matching if self._on_cancel(goal.info.goal_id)]
        with self._lock:
            for goal in canceling:
                if goal.status in CANCELABLE:
                    goal.status = STATUS_CANCELING
        # Error codes of action_msgs/srv/CancelGoal
        code = CANCEL_REJECTED if matching and not canceling else CANCEL_NONE
        if not matching and _is_single_goal(requested):
            code = CANCEL_GOAL_TERMINATED if exists else CANCEL_UNKNOWN_GOAL
        call.respond(CancelGoal_Response(code, tuple(goal.info for goal in canceling)))
        self._publish_status()

    def _publish_status(self) -> None:
        with self._lock:
            status = tuple(GoalStatus(goal.info, goal.status) for goal in self._goals.values())
            self._status.publish(GoalStatusArray(status))

    def _prune_finished(self) -> None:
        ended = [key for key, goal in self._goals.items() if goal.status in TERMINAL_STATES]
        for key in ended[:-MAX_FINISHED_GOALS]:
            del self._goals[key]


def _is_single_goal(requested: GoalInfo) -> bool:
    """Return whether the cancel request names a single goal: an id and a zero stamp."""
    return bool(np.any(requested.goal_id.uuid)) and requested.stamp.ns == 0


def _matches(requested: GoalInfo, goal: _Goal) -> bool:
    """Return whether a cancel request covers a goal that can be canceled.

    A request without id and stamp covers all goals; a stamp covers the goals accepted up to then; an id
    covers that goal too.
    """
    if goal.status not in CANCELABLE:
        return False
    if requested.goal_id.key == goal.info.goal_id.key:
        return True
    no_id = not np.any(requested.goal_id.uuid)
    return (no_id and requested.stamp.ns == 0) or (
        requested.stamp.ns > 0 and goal.info.stamp.ns <= requested.stamp.ns
    )


def _distinct(
    versions: tuple[ActionVersion, ...], key: Callable[[ActionVersion], str]
) -> list[ActionVersion]:
    """Return the newest version of each group with the same type hash."""
    return list({key(version): version for version in reversed(versions)}.values())[::-1]


def _now() -> Time:
    return Time.of(time.time_ns())
