"""Teleoperation with a gamepad: hold a dead-man button and move a stick; another button is the emergency
stop."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.control.gamepad_teleop import GamepadEvent, GamepadParams, GamepadTeleop
from chefbot.devices.gamepad_reader import AUTO, GamepadReader
from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import Device, In, Out, every, topic

COMMAND_RATE, STOP_REQUEST_RATE = 20.0, 5.0
"""Rates of the velocity commands and of the repeated stop requests, Hz."""
STOPPED, RELEASED = "STOP: the robot is stopped.", "STOP was released."
HOW_TO = """\
Hold the left shoulder button and push the left stick; release to stop. Directional pad up / down: faster / slower.
     The red button (B, circle) is STOP; it is released in the web UI."""


class GamepadDeviceParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the gamepad: its device file and its buttons."""

    device: Annotated[
        str, Meta(min_length=1, description="path of an input device, or auto: the first gamepad")
    ] = AUTO
    drive: GamepadParams = GamepadParams()


class GamepadDevice(Device):
    """Publishes `cmd_vel_teleop` while the dead-man button is held, one stop when it is released, then
    nothing.

    A gamepad that is unplugged, or sends nothing for long, counts as released. The emergency stop is
    requested until the robot confirms it.
    """

    params: GamepadDeviceParams
    emergency_stop: In[Bool]
    cmd_vel_teleop: Out[Twist]
    stop_request: Out[Bool]
    notice: Out[String] = topic("gamepad/notice")

    def start(self) -> None:
        """Start to read the gamepad; UserError if the given one does not exist."""
        path = self.params.device
        if path != AUTO and not Path(path).exists():
            raise UserError(f"the gamepad {path} does not exist; plug it in, or set device:=auto")
        self._drive = GamepadTeleop(Limits.of(self.robot), self.params.drive)
        self._driving = self._stop_requested = self._stopped = False
        self._last_notice = ""
        self.announcement = HOW_TO
        self._reader = GamepadReader(
            path,
            lambda path, name: self.post(partial(self._on_connected, path, name)),
            lambda events: self.post(partial(self._on_events, events)),
            lambda reason: self.post(partial(self._on_disconnected, reason)),
            lambda reason: self.post(partial(self._notice_once, f"Gamepad: {reason}.")),
        )

    def stop(self) -> None:
        """Close the gamepad and end its thread."""
        super().stop()
        self._reader.close()

    def on_emergency_stop(self, stopped: Bool) -> None:
        """Log when the robot confirms or releases the emergency stop, and end the repeated request."""
        if stopped.data:
            self._stop_requested = False
        if stopped.data or self._stopped:
            self.post(partial(self.notice.publish, String(STOPPED if stopped.data else RELEASED)))
        self._stopped = stopped.data

    @every(hz=COMMAND_RATE)
    def drive(self) -> None:
        """Publish the velocity command of the sticks while the dead-man button is held."""
        held, twist = self._drive.enabled, self._drive.twist(1.0 / COMMAND_RATE)
        if twist is not None:
            self._driving = True
            self.cmd_vel_teleop.publish(Twist.of(*twist))
        elif held:
            timeout = self.params.drive.timeout
            self._release(
                f"Nothing new from the gamepad for {timeout:g} s: release the button and press it again."
            )

    @every(hz=STOP_REQUEST_RATE)
    def repeat_stop_request(self) -> None:
        """Repeat the stop request until the robot confirms it."""
        if self._stop_requested:
            self.stop_request.publish(Bool(True))

    # -- callbacks of the thread, run in the event loop

    def _on_connected(self, path: str, name: str) -> None:
        self._drive.reset()
        self._notice_once(f"Gamepad {name or 'found'} at {path}.")

    def _on_events(self, events: list[GamepadEvent]) -> None:
        previous_share = self._drive.speed_fraction
        for event in events:
            if self._drive.process_event(event):
                self._stop_requested = True
                self.stop_request.publish(Bool(True))
        # The dead-man button was released: stop at once.
        if self._driving and not self._drive.enabled:
            self._release("")
        if self._drive.speed_fraction != previous_share:
            self.notice.publish(String(f"Speed: {100.0 * self._drive.speed_fraction:.0f} % of the robot's."))

    def _on_disconnected(self, reason: str) -> None:
        self._drive.reset()
        self._release(f"Warning: {reason}; the robot stops.")

    def _release(self, notice: str) -> None:
        """Publish one stop at once: after it, without commands, navigation may drive again."""
        self._driving = False
        self.cmd_vel_teleop.publish(Twist())
        if notice:
            self._notice_once(notice)

    def _notice_once(self, sentence: str) -> None:
        if sentence != self._last_notice:
            self._last_notice = sentence
            self.notice.publish(String(sentence))
