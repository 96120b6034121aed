"""A server of an action as ROS 2 clients expect it: three services and two topics.

What clients of other distributions define differently (`msgs.editions`) is served in their form beside ours.
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
from chefbot.msgs.idl.editions import convert, editions
from chefbot.msgs.idl.message import Message
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos import LATCHED
from chefbot.ros2.rmw.service import Call

Edition = Action[Any, Any, Any]
ENDED = (STATUS_SUCCEEDED, STATUS_CANCELED, STATUS_ABORTED)
KEPT = 16
"""Ended goals whose results may still be asked for."""
CANCELABLE = (STATUS_ACCEPTED, STATUS_EXECUTING)
OnGoal = Callable[[UUID, Any], bool]
OnCancel = Callable[[UUID], bool]


class _Goal:
    """A goal and who waits for its result."""

    def __init__(self, info: GoalInfo) -> None:
        self.info = info
        self.status = STATUS_ACCEPTED
        self.result: Message | None = None
        self.waiting: list[Callable[[int, Message], None]] = []


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
        forms = (action, *editions(action.ros_name))
        self._feedback = [
            (one.feedback, node.publisher(base + "feedback", one.feedback_message), one.feedback_message)
            for one in _each_once(forms, lambda one: type_hash(one.feedback_message))
        ]
        self._status = node.publisher(base + "status", GoalStatusArray, LATCHED)
        for one in _each_once(forms, lambda one: one.send_goal_service.type_hash):
            node.server(base + "send_goal", one.send_goal_service, partial(self._send_goal, one))
        for one in _each_once(forms, lambda one: one.get_result_service.type_hash):
            node.server(base + "get_result", one.get_result_service, partial(self._get_result, one))
        node.server(base + "cancel_goal", CancelGoal, self._cancel_goal)

    def feedback(self, goal_id: UUID, feedback: Message) -> None:
        """How it goes."""
        for kind, publisher, wrap in self._feedback:
            publisher.publish(wrap(goal_id, convert(feedback, kind)))

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
        for answer in waiting:
            answer(status, result)
        self._tell()

    def _send_goal(self, form: Edition, call: Call[Any, Any]) -> None:
        goal_id: UUID = call.request.goal_id
        with self._lock:
            new = goal_id.key not in self._goals
            info = self._goals.setdefault(goal_id.key, _Goal(GoalInfo(goal_id, _now()))).info
        accepted = new and self._on_goal(goal_id, convert(call.request.goal, self.action.goal))
        if new and not accepted:
            with self._lock:
                del self._goals[goal_id.key]
        call.answer(form.send_goal_service.response(accepted, info.stamp))
        self._tell()

    def _get_result(self, form: Edition, call: Call[Any, Any]) -> None:
        def answer(status: int, result: Message) -> None:
            call.answer(form.get_result_service.response(status, convert(result, form.result)))

        with self._lock:
            goal = self._goals.get(call.request.goal_id.key)
            if goal is not None and goal.result is None:
                goal.waiting.append(answer)
                return
        if goal is None or goal.result is None:
            answer(STATUS_UNKNOWN, self.action.result())
        else:
            answer(goal.status, goal.result)

    def _cancel_goal(self, call: Call[Any, Any]) -> None:
        """What is meant and answered is as rcl_action has it (`rcl_action_process_cancel_request`)."""
        asked: GoalInfo = call.request.goal_info
        with self._lock:
            chosen = [one for one in self._goals.values() if _is_meant(asked, one)]
            known = asked.goal_id.key in self._goals
        given_up = [one for one in chosen if self._on_cancel(one.info.goal_id)]
        with self._lock:
            for one in given_up:
                if one.status in CANCELABLE:
                    one.status = STATUS_CANCELING
        code = CANCEL_REJECTED if chosen and not given_up else CANCEL_NONE
        if not chosen and _is_one(asked):
            code = CANCEL_GOAL_TERMINATED if known else CANCEL_UNKNOWN_GOAL
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


def _is_one(asked: GoalInfo) -> bool:
    """Whether a single goal is named: an id and no time."""
    return bool(np.any(asked.goal_id.uuid)) and asked.stamp.ns == 0


def _is_meant(asked: GoalInfo, goal: _Goal) -> bool:
    """Neither id nor time means all, a time those accepted until then, an id that one too."""
    if goal.status not in CANCELABLE:
        return False
    if asked.goal_id.key == goal.info.goal_id.key:
        return True
    nameless = not np.any(asked.goal_id.uuid)
    return (nameless and asked.stamp.ns == 0) or (asked.stamp.ns > 0 and goal.info.stamp.ns <= asked.stamp.ns)


def _each_once(forms: tuple[Edition, ...], key: Callable[[Edition], str]) -> list[Edition]:
    """One edition, the newest, of those whose part is the same on the wire."""
    return list({key(one): one for one in reversed(forms)}.values())[::-1]


def _now() -> Time:
    return Time.of(time.time_ns())
