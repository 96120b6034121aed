"""sound_play: sounds and speech, for the node `soundplay_node.py` of ROS on the topic `robotsound`."""

from __future__ import annotations

from typing import ClassVar

from chefbot.msgs.idl.message import Float32, Int8, Message, String


class SoundRequest(Message, frozen=True, eq=False):
    """A sound to play, or a text for speech."""

    SPEECH: ClassVar[int] = -3
    PLAY_ONCE: ClassVar[int] = 1

    sound: Int8 = 0
    command: Int8 = 0
    volume: Float32 = 0.0
    """From 0 to 1."""
    arg: String = ""
    """The text, or the file to play."""
    arg2: String = ""
    """The voice, empty for the default one."""


def speech(text: str) -> SoundRequest:
    """Return the request for a text as speech, once."""
    return SoundRequest(SoundRequest.SPEECH, SoundRequest.PLAY_ONCE, 1.0, text)
