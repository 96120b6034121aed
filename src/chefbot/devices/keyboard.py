"""Teleoperation with the keys of a terminal, like the book chapter's teleop node."""

from __future__ import annotations

from chefbot.control.keyboard_teleop import DEAD_MAN_TIMEOUT, KeyboardTeleop
from chefbot.devices.terminal import Terminal
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import String
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import Device, NoParams, Out, every, topic

RATE = 10.0
"""Rate of the velocity commands, Hz."""
ARROWS = {"\x1b[A": "i", "\x1b[B": ",", "\x1b[C": "l", "\x1b[D": "j"}
"""Escape sequences of the arrow keys, and the letters with the same meaning."""
KEY_TABLE = """\
Hold a key to drive; {dead_man} s after its release the robot slows down and stops.
     u   i   o      forward to the left, forward, forward to the right
     j   k   l      turn left, stop, turn right
     m   ,   .      back to the left, back, back to the right
     q / z          both speeds up / down by 10 %
     w / x          forward speed only
     e / c          turning speed only
     space or k     stop at once
     any other key  slow down to a stop
     Ctrl-C         quit
   {speeds}; this robot's limits are {speed:.2f} m/s and {turn:.2f} rad/s."""


class KeyboardDevice(Device):
    """Publishes `cmd_vel_teleop` while keys are held and until the robot is at rest, then nothing.

    Without commands navigation may drive again, and the robot stops by itself.
    """

    params: NoParams
    cmd_vel_teleop: Out[Twist]
    notice: Out[String] = topic("keyboard/notice")

    def start(self) -> None:
        """Start to read the terminal's keys."""
        self._limits = Limits.of(self.robot)
        self._teleop = KeyboardTeleop(self._limits)
        self._pending_keys: list[str] = []
        self._moving = False
        self.announcement = KEY_TABLE.format(
            dead_man=DEAD_MAN_TIMEOUT,
            speeds=self._speed_text(),
            speed=self._limits.speed,
            turn=self._limits.angular_speed,
        )
        self._terminal = Terminal(self._on_keys, lambda: self.post(_terminal_lost))

    def stop(self) -> None:
        """Restore the terminal's settings and close it."""
        super().stop()
        self._terminal.close()

    @every(hz=RATE)
    def drive(self) -> None:
        """Process all keys since the last call and publish the velocity; the last key holds for the whole
        period."""
        keys, self._pending_keys = self._pending_keys, []
        previous_speeds = self._speed_text()
        for key in keys[:-1]:
            self._teleop.update(key, 0.0)
        v, w = self._teleop.update(keys[-1] if keys else None, 1.0 / RATE)
        moving = v != 0.0 or w != 0.0
        # Publish one final stop, then nothing.
        if keys or moving or self._moving:
            self.cmd_vel_teleop.publish(Twist.of(v, w))
        self._moving = moving
        if self._speed_text() != previous_speeds:
            self.notice.publish(String(self._speed_text()))

    def _on_keys(self, text: str) -> None:
        """Queue keys; called in the terminal's thread."""
        self.post(lambda: self._pending_keys.extend(keys_of(text)))

    def _speed_text(self) -> str:
        return f"Speed {self._teleop.speed:.2f} m/s, turn {self._teleop.turn:.2f} rad/s"


def keys_of(text: str) -> list[str]:
    """Convert terminal input to keys of the table; any other escape sequence is one other key."""
    for sequence, key in ARROWS.items():
        text = text.replace(sequence, key)
    plain, escape, _ = text.partition("\x1b")
    return [*plain.lower(), *escape]


def _terminal_lost() -> None:
    raise UserError("the terminal of the keyboard is gone; the robot stops")
