"""action_msgs: the status of goals, and their cancellation."""

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import Int8, Message
from chefbot.msgs.idl.service import define_service
from chefbot.msgs.unique_identifier_msgs import UUID

STATUS_UNKNOWN, STATUS_ACCEPTED, STATUS_EXECUTING, STATUS_CANCELING = range(4)
STATUS_SUCCEEDED, STATUS_CANCELED, STATUS_ABORTED = 4, 5, 6
CANCEL_NONE, CANCEL_REJECTED, CANCEL_UNKNOWN_GOAL, CANCEL_GOAL_TERMINATED = range(4)
"""Return codes of CancelGoal_Response."""


class GoalInfo(Message, frozen=True, eq=False):
    """The ID of a goal and the time when it was accepted."""

    goal_id: UUID = UUID()
    stamp: Time = Time()


class GoalStatus(Message, frozen=True, eq=False):
    """The status of one goal, a STATUS_ constant."""

    goal_info: GoalInfo = GoalInfo()
    status: Int8 = 0


class GoalStatusArray(Message, frozen=True, eq=False):
    """The status of all goals of an action server."""

    status_list: tuple[GoalStatus, ...] = ()


class CancelGoal_Request(Message, frozen=True, eq=False):  # noqa: N801 (the name on the wire)
    """A request to cancel a goal."""

    goal_info: GoalInfo = GoalInfo()


class CancelGoal_Response(Message, frozen=True, eq=False):  # noqa: N801 (the name on the wire)
    """The goals that are being cancelled, and a CANCEL_ return code."""

    return_code: Int8 = 0
    goals_canceling: tuple[GoalInfo, ...] = ()


CancelGoal = define_service(CancelGoal_Request, CancelGoal_Response)
