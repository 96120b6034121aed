"""tf2_msgs: the tree of frames."""

from __future__ import annotations

from chefbot.msgs.base import Message
from chefbot.msgs.geometry_msgs import TransformStamped


class TFMessage(Message, frozen=True, eq=False):
    """Some transforms of the tree."""

    transforms: tuple[TransformStamped, ...] = ()
