"""tf2_msgs: the tree of frames."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from chefbot.msgs.builtin_interfaces import Duration, Time
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.action import define_action
from chefbot.msgs.idl.message import Bool, Message, String, Uint8
from chefbot.msgs.idl.service import define_service


class TFMessage(Message, frozen=True, eq=False):
    """Some transforms of the tree."""

    transforms: tuple[TransformStamped, ...] = ()


class TF2Error(Message, frozen=True, eq=False):
    """0, or why a transform cannot be had."""

    error: Uint8 = 0
    error_string: String = ""


class FrameGraph_Request(Message, frozen=True, eq=False):
    """The tree, please."""

    structure_needs_at_least_one_member: Uint8 = 0


class FrameGraph_Response(Message, frozen=True, eq=False):
    """It, as YAML."""

    frame_yaml: String = ""


class LookupTransform_Goal(Message, frozen=True, eq=False):
    """A transform, as soon as it can be had; `advanced` with two times and a frame that stays."""

    target_frame: String = ""
    source_frame: String = ""
    source_time: Time = Time()
    timeout: Duration = Duration()
    target_time: Time = Time()
    fixed_frame: String = ""
    advanced: Bool = False


class LookupTransform_Result(Message, frozen=True, eq=False):
    """It, or why not."""

    transform: TransformStamped = TransformStamped()
    error: TF2Error = TF2Error()


class LookupTransform_Feedback(Message, frozen=True, eq=False):
    """None."""

    structure_needs_at_least_one_member: Uint8 = 0


FrameGraph = define_service(FrameGraph_Request, FrameGraph_Response)
LookupTransform = define_action(LookupTransform_Goal, LookupTransform_Result, LookupTransform_Feedback)
