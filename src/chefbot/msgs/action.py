"""Actions: a goal, a result, feedback, and the messages that carry them."""

from __future__ import annotations

import sys
from typing import Generic, NamedTuple, TypeVar, cast

import msgspec

from chefbot.msgs.base import Int8, Message
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.unique_identifier_msgs import UUID

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class Action(NamedTuple, Generic[G, R, F]):
    """The types of one action; the last three are what travels (ROS 2 design, "Actions")."""

    name: str
    goal: type[G]
    result: type[R]
    feedback: type[F]
    send_goal: type[Message]
    """`goal_id, goal`"""
    feedback_message: type[Message]
    """`goal_id, feedback`"""
    outcome: type[Message]
    """`goal_id, status, result`: what get_result answers, with the goal that it belongs to."""


def define_action(goal: type[G], result: type[R], feedback: type[F]) -> Action[G, R, F]:
    """The action whose three parts are given; they are named X_Goal, X_Result, X_Feedback."""
    name = goal.__name__.removesuffix("_Goal")
    module = goal.__module__

    def wrapper(suffix: str, fields: list[tuple[str, type, object]]) -> type[Message]:
        kind: type[Message] = cast(
            type[Message],
            msgspec.defstruct(
                f"{name}_{suffix}", fields, bases=(Message,), module=module, frozen=True, eq=False
            ),
        )
        setattr(sys.modules[module], kind.__name__, kind)
        return kind

    return Action(
        name,
        goal,
        result,
        feedback,
        wrapper("SendGoal_Request", [("goal_id", UUID, UUID()), ("goal", goal, goal())]),
        wrapper("FeedbackMessage", [("goal_id", UUID, UUID()), ("feedback", feedback, feedback())]),
        wrapper(
            "Outcome",
            [
                ("goal_id", UUID, UUID()),
                ("status", Int8, 0),
                ("stamp", Time, Time()),
                ("result", result, result()),
            ],
        ),
    )
