"""Device that drives a robot elsewhere through its web UI."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.errors import UserError
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, String
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.runtime.node import Device, In, Out, topic
from chefbot.ui.commands import Drive, ReleaseStop, Stop
from chefbot.ui.remote.web_ui_client import ConnectionLostError, WebUiClient

MIN_PERIOD_NS = 50_000_000
"""Minimum period of commands, ns, as the server disconnects clients above its rate limit; its timeout is 0.3
s."""

REPEAT_NS = 5_000_000_000
"""Minimum time before the same notice is repeated, ns."""


class RemoteDriveParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the remote drive: the web UI's address."""

    page: Annotated[str, Meta(min_length=1, description="address of the running robot's web UI")]


class RemoteDriveDevice(Device):
    """Forwards `cmd_vel_teleop` as fractions of the robot's limits; without commands the web UI's server
    stops the robot.

    Emergency stops are forwarded too, and the robot's state is published on `emergency_stop`.
    """

    params: RemoteDriveParams
    cmd_vel_teleop: In[Twist]
    stop_request: In[Bool]
    emergency_stop: Out[Bool] = topic(latched=True)
    notice: Out[String] = topic("remote_drive/notice")

    def start(self) -> None:
        """Connect to the robot's web UI; UserError where there is none."""
        self._page = WebUiClient(self.params.page)
        self._sent_ns = self.now_ns - MIN_PERIOD_NS
        self._last_notice = ("", self.now_ns)
        self._stopped: bool | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._receive_loop, name="remote drive", daemon=True)
        self._thread.start()
        self.announcement = f"Driving the robot at {self._page.url}"

    def stop(self) -> None:
        """Close the connection, which stops the robot."""
        super().stop()
        self._closing = True
        self._page.close()
        self._thread.join()

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """Forward a velocity at the limited rate; a stop is forwarded at once."""
        command = Drive(
            _fraction(twist.linear.x, max_speed(self.robot)), _fraction(twist.angular.z, max_turn(self.robot))
        )
        if command.is_zero or self.now_ns - self._sent_ns >= MIN_PERIOD_NS:
            self._sent_ns = self.now_ns
            self._page.send(command)

    def on_stop_request(self, press: Bool) -> None:
        """Forward an emergency stop or its release at once."""
        self._page.send(Stop() if press.data else ReleaseStop())

    def _on_status(self, stopped: bool) -> None:
        if stopped is not self._stopped:
            self._stopped = stopped
            self.emergency_stop.publish(Bool(stopped))

    def _receive_loop(self) -> None:
        """Receive the server's answers until the connection is closed; runs in a thread."""
        while True:
            try:
                if self._page.receive() == "status" and self._page.latest["status"] is not None:
                    self.post(partial(self._on_status, bool(self._page.latest["status"]["stopped"])))
            except ConnectionLostError as error:
                if not self._closing:
                    self.post(_raiser(error))
                return
            except UserError as error:
                self.post(partial(self._notice_once, str(error)))

    def _notice_once(self, sentence: str) -> None:
        """Log a sentence, the same one only once per period: each command is answered while another client
        drives."""
        last_sentence, last_ns = self._last_notice
        if sentence != last_sentence or self.now_ns - last_ns >= REPEAT_NS:
            self._last_notice = (sentence, self.now_ns)
            self.notice.publish(String(sentence))


def _fraction(value: float, limit: float) -> float:
    return min(1.0, max(-1.0, value / limit))


def _raiser(error: ConnectionLostError) -> Callable[[], None]:
    def fail() -> None:
        raise error

    return fail
