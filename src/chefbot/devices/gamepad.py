"""Driving with a gamepad: hold a button and push a stick; another button is STOP."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.control.gamepad_teleop import GamepadDrive, GamepadParams, PadEvent
from chefbot.devices.joystick import AUTO, Joystick
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import Device, In, Out, every, topic

RATE, ASK_RATE = 20.0, 5.0
STOPPED, RELEASED = "STOP: the robot is stopped.", "STOP was released."
HOW_TO = """\
Hold the left shoulder button and push the left stick; let go to stop. Cross up / down: faster / slower.
     The red button (B, circle) is STOP; it is released on the robot's page."""


class GamepadDeviceParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which pad, and what its buttons mean."""

    device: Annotated[
        str, Meta(min_length=1, description="a joystick's path, or auto: the first of /dev/input/js*")
    ] = AUTO
    drive: GamepadParams = GamepadParams()


class GamepadDevice(Device):
    """Says `cmd_vel_teleop` while the dead-man button is held, one stop when it is let go, then is silent.

    A pad that is unplugged, or says nothing for long, has let go. STOP is asked for until the robot confirms it.
    """

    params: GamepadDeviceParams
    emergency_stop: In[Bool]
    cmd_vel_teleop: Out[Twist]
    stop_request: Out[Bool]
    remark: Out[String] = topic("gamepad/remark")

    def start(self) -> None:
        """Look for the pad; UserError if one was named that is not there."""
        path = self.params.device
        if path != AUTO and not Path(path).exists():
            raise UserError(f"the gamepad {path} does not exist; plug it in, or say device:=auto")
        self._drive = GamepadDrive(Limits.of(self.robot), self.params.drive)
        self._driving = self._stop_asked = self._stopped = False
        self._told = ""
        self.announcement = HOW_TO
        self._pad = Joystick(
            path,
            lambda path, name: self.post(partial(self._there, path, name)),
            lambda events: self.post(partial(self._hear, events)),
            lambda why: self.post(partial(self._gone, why)),
            lambda why: self.post(partial(self._say_once, f"Gamepad: {why}.")),
        )

    def stop(self) -> None:
        """Let go."""
        super().stop()
        self._pad.close()

    def on_emergency_stop(self, stopped: Bool) -> None:
        """The robot has heard it, or was released."""
        if stopped.data:
            self._stop_asked = False
        if stopped.data or self._stopped:
            self.post(partial(self.remark.publish, String(STOPPED if stopped.data else RELEASED)))
        self._stopped = stopped.data

    @every(hz=RATE)
    def drive(self) -> None:
        """What the hand wants."""
        held, twist = self._drive.held, self._drive.twist(1.0 / RATE)
        if twist is not None:
            self._driving = True
            self.cmd_vel_teleop.publish(Twist.of(*twist))
        elif held:
            patience = self.params.drive.patience
            self._let_go(
                f"Nothing new from the gamepad for {patience:g} s: let go of the button and press it again."
            )

    @every(hz=ASK_RATE)
    def ask_again(self) -> None:
        """For STOP, while the robot has not confirmed it."""
        if self._stop_asked:
            self.stop_request.publish(Bool(True))

    # -- what the thread tells, done in the loop

    def _there(self, path: str, name: str) -> None:
        self._drive.forget()
        self._say_once(f"Gamepad {name or 'found'} at {path}.")

    def _hear(self, events: list[PadEvent]) -> None:
        before = self._drive.share
        for event in events:
            if self._drive.hear(event):
                self._stop_asked = True
                self.stop_request.publish(Bool(True))
        if self._driving and not self._drive.held:
            self._let_go("")
        if self._drive.share != before:
            self.remark.publish(String(f"Speed: {100.0 * self._drive.share:.0f} % of the robot's."))

    def _gone(self, why: str) -> None:
        self._drive.forget()
        self._let_go(f"Warning: {why}; the robot stops.")

    def _let_go(self, why: str) -> None:
        """A stop is said at once, and once: silence lets navigation have the robot back."""
        self._driving = False
        self.cmd_vel_teleop.publish(Twist())
        if why:
            self._say_once(why)

    def _say_once(self, sentence: str) -> None:
        if sentence != self._told:
            self._told = sentence
            self.remark.publish(String(sentence))
