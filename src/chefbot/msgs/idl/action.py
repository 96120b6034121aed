"""Actions: a goal, a result, feedback, and the messages that carry them."""

from __future__ import annotations

import sys
from typing import Any, Generic, NamedTuple, TypeVar, cast

import msgspec

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.definition import Description, compose, describe, description_hash
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Bool, Int8, Message
from chefbot.msgs.idl.service import Service, define_service
from chefbot.msgs.unique_identifier_msgs import UUID

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class Action(NamedTuple, Generic[G, R, F]):
    """The types of one action; the last five are what travels (ROS 2 design, "Actions")."""

    name: str
    goal: type[G]
    result: type[R]
    feedback: type[F]
    send_goal: type[Message]
    """`goal_id, goal`"""
    feedback_message: type[Message]
    """`goal_id, feedback`"""
    outcome: type[Message]
    """`goal_id, status, stamp, result`: within a process, what get_result answers and for which goal."""
    send_goal_service: Service[Any, Any]
    """`goal_id, goal` -> `accepted, stamp`"""
    get_result_service: Service[Any, Any]
    """`goal_id` -> `status, result`"""

    @property
    def ros_name(self) -> str:
        """'nav2_msgs/action/NavigateToPose'"""
        return ros_type(self.goal).removesuffix("_Goal")

    @property
    def description(self) -> Description:
        """As type_description_interfaces tells it."""
        members = [
            ("goal", describe(self.goal)),
            ("result", describe(self.result)),
            ("feedback", describe(self.feedback)),
            ("send_goal_service", self.send_goal_service.description),
            ("get_result_service", self.get_result_service.description),
            ("feedback_message", describe(self.feedback_message)),
        ]
        return compose(self.ros_name, members)

    @property
    def type_hash(self) -> str:
        """'RIHS01_...' of the action."""
        return description_hash(self.description)


def define_action(goal: type[G], result: type[R], feedback: type[F]) -> Action[G, R, F]:
    """The action whose three parts are given; they are named X_Goal, X_Result, X_Feedback."""
    name = goal.__name__.removesuffix("_Goal")
    module = goal.__module__

    def wrapper(suffix: str, fields: list[tuple[str, type, object]]) -> type[Message]:
        kind: type[Message] = cast(
            type[Message],
            msgspec.defstruct(
                f"{name}_{suffix}",
                fields,
                bases=(Message,),
                module=module,
                namespace={"ROS_PACKAGE": goal.ROS_PACKAGE},
                frozen=True,
                eq=False,
            ),
        )
        setattr(sys.modules[module], kind.__name__, kind)
        return kind

    which, when = ("goal_id", UUID, UUID()), ("stamp", Time, Time())
    status, outcome = ("status", Int8, 0), ("result", result, result())
    send_goal = wrapper("SendGoal_Request", [which, ("goal", goal, goal())])
    accepted = wrapper("SendGoal_Response", [("accepted", Bool, False), when])
    get_result = wrapper("GetResult_Request", [which])
    got = wrapper("GetResult_Response", [status, outcome])
    return Action(
        name,
        goal,
        result,
        feedback,
        send_goal,
        wrapper("FeedbackMessage", [which, ("feedback", feedback, feedback())]),
        wrapper("Outcome", [which, status, when, outcome]),
        define_service(send_goal, accepted),
        define_service(get_result, got),
    )
