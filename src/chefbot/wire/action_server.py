"""A server of an action as ROS 2 clients expect it: three services and two topics."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from chefbot.msgs.action import Action
from chefbot.msgs.action_msgs import (
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
from chefbot.msgs.base import Message
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.wire.node import WireNode
from chefbot.wire.qos import LATCHED
from chefbot.wire.service import Call

ENDED = (STATUS_SUCCEEDED, STATUS_CANCELED, STATUS_ABORTED)
KEPT = 16
"""Ended goals whose results may still be asked for."""
OnGoal = Callable[[UUID, Any], bool]
OnCancel = Callable[[UUID], bool]


class _Goal:
    """A goal and who waits for its result."""

    def __init__(self, info: GoalInfo) -> None:
        self.info = info
        self.status = STATUS_ACCEPTED
        self.result: Message | None = None
        self.waiting: list[Call[Any, Any]] = []


class ActionServer:
    """Serves an action under `name`.

    `on_goal(goal_id, goal)` says whether it is accepted, `on_cancel(goal_id)` whether it will be given up; both
    run in Zenoh's thread and must return at once. Then call `feedback`, and in the end `finish`, from any thread.
    """

    def __init__(
        self, node: WireNode, name: str, action: Action[Any, Any, Any], on_goal: OnGoal, on_cancel: OnCancel
    ) -> None:
        self.action = action
        self._on_goal, self._on_cancel = on_goal, on_cancel
        self._goals: dict[bytes, _Goal] = {}
        self._lock = threading.RLock()
        base = f"{name}/_action/"
        self._feedback = node.publisher(base + "feedback", action.feedback_message)
        self._status = node.publisher(base + "status", GoalStatusArray, LATCHED)
        node.server(base + "send_goal", action.send_goal_service, self._send_goal)
        node.server(base + "get_result", action.get_result_service, self._get_result)
        node.server(base + "cancel_goal", CancelGoal, self._cancel_goal)

    def feedback(self, goal_id: UUID, feedback: Message) -> None:
        """How it goes."""
        self._feedback.publish(self.action.feedback_message(goal_id, feedback))

    def begin(self, goal_id: UUID) -> None:
        """Work has begun; also for goals that did not come over the wire, so that others see them."""
        with self._lock:
            self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now()))).status = STATUS_EXECUTING
        self._tell()

    def finish(self, goal_id: UUID, status: int, result: Message) -> None:
        """How it ended: succeeded, canceled or aborted. Those who wait get the result."""
        with self._lock:
            goal = self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now())))
            goal.status, goal.result = status, result
            waiting, goal.waiting = goal.waiting, []
            self._forget_old()
        for call in waiting:
            call.answer(self.action.get_result_service.response(status, result))
        self._tell()

    def _send_goal(self, call: Call[Any, Any]) -> None:
        goal_id: UUID = call.request.goal_id
        with self._lock:
            new = goal_id.key not in self._goals
            if new:
                self._goals[goal_id.key] = _Goal(GoalInfo(goal_id, _now()))
        accepted = new and self._on_goal(goal_id, call.request.goal)
        if new and not accepted:
            with self._lock:
                del self._goals[goal_id.key]
        call.answer(self.action.send_goal_service.response(accepted, _now()))
        self._tell()

    def _get_result(self, call: Call[Any, Any]) -> None:
        with self._lock:
            goal = self._goals.get(call.request.goal_id.key)
            if goal is not None and goal.result is None:
                goal.waiting.append(call)
                return
        if goal is None:
            call.answer(self.action.get_result_service.response(STATUS_UNKNOWN, self.action.result()))
        else:
            call.answer(self.action.get_result_service.response(goal.status, goal.result))

    def _cancel_goal(self, call: Call[Any, Any]) -> None:
        """By action_msgs/srv/CancelGoal: an id, a time, both, or neither, which means all."""
        with self._lock:
            meant = [one for one in self._goals.values() if one.status not in ENDED]
            chosen = [one for one in meant if _is_meant(call.request.goal_info, one.info)]
        given_up = [one for one in chosen if self._on_cancel(one.info.goal_id)]
        with self._lock:
            for one in given_up:
                if one.status not in ENDED:
                    one.status = STATUS_CANCELING
        code = CANCEL_NONE if given_up else CANCEL_REJECTED if chosen else CANCEL_UNKNOWN_GOAL
        call.answer(CancelGoal_Response(code, tuple(one.info for one in given_up)))
        self._tell()

    def _tell(self) -> None:
        with self._lock:
            status = tuple(GoalStatus(one.info, one.status) for one in self._goals.values())
            self._status.publish(GoalStatusArray(status))

    def _forget_old(self) -> None:
        ended = [key for key, one in self._goals.items() if one.status in ENDED]
        for key in ended[:-KEPT]:
            del self._goals[key]


def _is_meant(asked: GoalInfo, goal: GoalInfo) -> bool:
    by_id, by_time = bool(np.any(asked.goal_id.uuid)), asked.stamp.ns > 0
    if not by_id and not by_time:
        return True
    same = by_id and asked.goal_id.key == goal.goal_id.key
    return same or (by_time and goal.stamp.ns <= asked.stamp.ns)


def _now() -> Time:
    return Time.of(time.time_ns())
