"""Action types: goal, result, feedback, and the messages and services that transport them."""

from __future__ import annotations

import sys
from typing import Any, Generic, NamedTuple, TypeVar

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.definition import Description, compose, describe, description_hash
from chefbot.msgs.idl.fields import ros_type
from chefbot.msgs.idl.message import Bool, Int8, Message, define_message
from chefbot.msgs.idl.service import Service, define_service
from chefbot.msgs.unique_identifier_msgs import UUID

G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)


class Action(NamedTuple, Generic[G, R, F]):
    """The types of one action; the last five are those that are transported (ROS 2 design, "Actions")."""

    name: str
    goal: type[G]
    result: type[R]
    feedback: type[F]
    send_goal: type[Message]
    """Message with the fields `goal_id, goal`."""
    feedback_message: type[Message]
    """Message with the fields `goal_id, feedback`."""
    outcome: type[Message]
    """Message with the fields `goal_id, status, stamp, result`: the result of a goal within a process."""
    send_goal_service: Service[Any, Any]
    """Service with request `goal_id, goal` and response `accepted, stamp`."""
    get_result_service: Service[Any, Any]
    """Service with request `goal_id` and response `status, result`."""

    @property
    def ros_name(self) -> str:
        """ROS name of the action type, such as 'nav2_msgs/action/NavigateToPose'."""
        return ros_type(self.goal).removesuffix("_Goal")

    @property
    def description(self) -> Description:
        """Type description of the action, as in type_description_interfaces."""
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
        """Type hash 'RIHS01_...' of the action (REP-2016)."""
        return description_hash(self.description)


def define_action(goal: type[G], result: type[R], feedback: type[F]) -> Action[G, R, F]:
    """Define an action by its three parts, which are named X_Goal, X_Result, X_Feedback."""
    name = goal.__name__.removesuffix("_Goal")
    module = goal.__module__

    def wrapper(suffix: str, fields: list[tuple[str, type, object]]) -> type[Message]:
        kind = define_message(f"{name}_{suffix}", fields, module, goal.ROS_PACKAGE)
        setattr(sys.modules[module], kind.__name__, kind)
        return kind

    goal_id, stamp = ("goal_id", UUID, UUID()), ("stamp", Time, Time())
    status, result_field = ("status", Int8, 0), ("result", result, result())
    send_goal_request = wrapper("SendGoal_Request", [goal_id, ("goal", goal, goal())])
    send_goal_response = wrapper("SendGoal_Response", [("accepted", Bool, False), stamp])
    get_result_request = wrapper("GetResult_Request", [goal_id])
    get_result_response = wrapper("GetResult_Response", [status, result_field])
    return Action(
        name,
        goal,
        result,
        feedback,
        send_goal_request,
        wrapper("FeedbackMessage", [goal_id, ("feedback", feedback, feedback())]),
        wrapper("Outcome", [goal_id, status, stamp, result_field]),
        define_service(send_goal_request, send_goal_response),
        define_service(get_result_request, get_result_response),
    )
