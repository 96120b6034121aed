"""sound_play: what the robot says, as the node `soundplay_node.py` of ROS hears it on the topic `robotsound`."""

from __future__ import annotations

from typing import ClassVar

from chefbot.msgs.idl.message import Float32, Int8, Message, String


class SoundRequest(Message, frozen=True, eq=False):
    """A sound to play, or a text to say."""

    SAY: ClassVar[int] = -3
    PLAY_ONCE: ClassVar[int] = 1

    sound: Int8 = 0
    command: Int8 = 0
    volume: Float32 = 0.0
    """From 0 to 1."""
    arg: String = ""
    """The text to say, or the file to play."""
    arg2: String = ""
    """The voice, empty for the default one."""


def say(text: str) -> SoundRequest:
    """Return the request to say a text once."""
    return SoundRequest(SoundRequest.SAY, SoundRequest.PLAY_ONCE, 1.0, text)
