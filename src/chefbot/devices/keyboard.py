"""Driving with the keys of a terminal, as the chapter's teleoperation does it."""

from __future__ import annotations

from chefbot.control.keyboard_teleop import DEAD_MAN, Teleop
from chefbot.devices.terminal import Terminal
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import Device, NoParams, Out, every, topic

RATE = 10.0
ARROWS = {"\x1b[A": "i", "\x1b[B": ",", "\x1b[C": "l", "\x1b[D": "j"}
"""What a terminal sends for the arrow keys; they mean the same as these letters."""
KEY_TABLE = """\
Hold a key to drive; {dead_man} s after it was let go the robot slows down to a stop.
     u   i   o      forward to the left, forward, forward to the right
     j   k   l      turn left, stop, turn right
     m   ,   .      back to the left, back, back to the right
     q / z          both speeds up / down by a tenth
     w / x          forward speed alone
     e / c          turning speed alone
     space or k     stop at once
     any other key  slow down to a stop
     Ctrl-C         quit
   {speeds}; this robot's limits are {speed:.2f} m/s and {turn:.2f} rad/s."""


class KeyboardDevice(Device):
    """Says `cmd_vel_teleop` while keys are held and until the robot stands, then is silent.

    Silence lets navigation have the robot back, and a robot that hears nothing stops by itself.
    """

    params: NoParams
    cmd_vel_teleop: Out[Twist]
    remark: Out[String] = topic("keyboard/remark")

    def start(self) -> None:
        """Listen to the terminal."""
        self._limits = Limits.of(self.robot)
        self._teleop = Teleop(self._limits)
        self._pressed: list[str] = []
        self._moving = False
        self.announcement = KEY_TABLE.format(
            dead_man=DEAD_MAN, speeds=self._speeds(), speed=self._limits.speed, turn=self._limits.turn
        )
        self._terminal = Terminal(self._hear, lambda: self.post(_lost))

    def stop(self) -> None:
        """Give the terminal back."""
        super().stop()
        self._terminal.close()

    @every(hz=RATE)
    def drive(self) -> None:
        """All keys since the last time count, the last of them longest."""
        keys, self._pressed = self._pressed, []
        before = self._speeds()
        for key in keys[:-1]:
            self._teleop.update(key, 0.0)
        v, w = self._teleop.update(keys[-1] if keys else None, 1.0 / RATE)
        moving = v != 0.0 or w != 0.0
        if keys or moving or self._moving:
            self.cmd_vel_teleop.publish(Twist.of(v, w))
        self._moving = moving
        if self._speeds() != before:
            self.remark.publish(String(self._speeds()))

    def _hear(self, text: str) -> None:
        """In the terminal's thread."""
        self.post(lambda: self._pressed.extend(keys_of(text)))

    def _speeds(self) -> str:
        return f"Speed {self._teleop.speed:.2f} m/s, turn {self._teleop.turn:.2f} rad/s"


def keys_of(text: str) -> list[str]:
    """What a terminal sent, as keys of the table; any other escape sequence is one other key."""
    for sequence, key in ARROWS.items():
        text = text.replace(sequence, key)
    plain, escape, _ = text.partition("\x1b")
    return [*plain.lower(), *escape]


def _lost() -> None:
    raise UserError("the terminal of the keyboard is gone; the robot stops")
