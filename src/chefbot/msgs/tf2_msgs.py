"""tf2_msgs: transforms and the transform tree."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Duration, Time
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.action import define_action
from chefbot.msgs.idl.message import Bool, Message, String, Uint8
from chefbot.msgs.idl.service import define_service


class TFMessage(Message, frozen=True, eq=False):
    """Transforms of the transform tree, published on /tf and /tf_static."""

    transforms: tuple[TransformStamped, ...] = ()


class TF2Error(Message, frozen=True, eq=False):
    """The error code of a transform lookup, 0 on success, and a description."""

    error: Uint8 = 0
    error_string: String = ""


class FrameGraph_Request(Message, frozen=True, eq=False):
    """A request for the transform tree."""

    structure_needs_at_least_one_member: Uint8 = 0


class FrameGraph_Response(Message, frozen=True, eq=False):
    """The transform tree as YAML."""

    frame_yaml: String = ""


class LookupTransform_Goal(Message, frozen=True, eq=False):
    """Look up a transform as soon as it is available.

    `advanced`: between two times, by way of a fixed frame.
    """

    target_frame: String = ""
    source_frame: String = ""
    source_time: Time = Time()
    timeout: Duration = Duration()
    target_time: Time = Time()
    fixed_frame: String = ""
    advanced: Bool = False


class LookupTransform_Result(Message, frozen=True, eq=False):
    """The transform, or the error if it is not available."""

    transform: TransformStamped = TransformStamped()
    error: TF2Error = TF2Error()


class LookupTransform_Feedback(Message, frozen=True, eq=False):
    """Feedback without content; ROS requires one member."""

    structure_needs_at_least_one_member: Uint8 = 0


FrameGraph = define_service(FrameGraph_Request, FrameGraph_Response)
LookupTransform = define_action(LookupTransform_Goal, LookupTransform_Result, LookupTransform_Feedback)
