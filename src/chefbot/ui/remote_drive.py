"""Drives a robot that runs elsewhere, by its page."""

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
from chefbot.ui.commands import Drive, Resume, Stop
from chefbot.ui.remote import PageGoneError, RemotePage

MIN_PERIOD_NS = 50_000_000
"""No more often than this, for the page drops who says too much; it wants a word every 0.3 s."""

REPEAT_NS = 5_000_000_000


class RemoteDriveParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which robot."""

    page: Annotated[str, Meta(min_length=1, description="address of the running robot's page")]


class RemoteDriveDevice(Device):
    """Passes `cmd_vel_teleop` on as shares of the robot's limits; in silence the page stops the robot.

    STOP goes the same way, and what the page says of it comes back on `emergency_stop`.
    """

    params: RemoteDriveParams
    cmd_vel_teleop: In[Twist]
    stop_request: In[Bool]
    emergency_stop: Out[Bool] = topic(latched=True)
    remark: Out[String] = topic("remote_drive/remark")

    def start(self) -> None:
        """Connect."""
        self._page = RemotePage(self.params.page)
        self._sent_ns = self.now_ns - MIN_PERIOD_NS
        self._told = ("", self.now_ns)
        self._stopped: bool | None = None
        self._closing = False
        self._thread = threading.Thread(target=self._listen, name="remote drive", daemon=True)
        self._thread.start()
        self.announcement = f"Driving the robot at {self.params.page}"

    def stop(self) -> None:
        """Let go and leave."""
        super().stop()
        self._closing = True
        self._page.close()
        self._thread.join()

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """A stop is never held back."""
        command = Drive(
            _share(twist.linear.x, max_speed(self.robot)), _share(twist.angular.z, max_turn(self.robot))
        )
        if command.still or self.now_ns - self._sent_ns >= MIN_PERIOD_NS:
            self._sent_ns = self.now_ns
            self._page.send(command)

    def on_stop_request(self, press: Bool) -> None:
        """Never held back."""
        self._page.send(Stop() if press.data else Resume())

    def _hear_status(self, stopped: bool) -> None:
        if stopped is not self._stopped:
            self._stopped = stopped
            self.emergency_stop.publish(Bool(stopped))

    def _listen(self) -> None:
        """In a thread: the page's answers, and its end."""
        while True:
            try:
                if self._page.receive() == "status" and self._page.latest["status"] is not None:
                    self.post(partial(self._hear_status, bool(self._page.latest["status"]["stopped"])))
            except PageGoneError as error:
                if not self._closing:
                    self.post(_raiser(error))
                return
            except UserError as error:
                self.post(partial(self._tell, str(error)))

    def _tell(self, sentence: str) -> None:
        """The same not ten times a second: every word of ours is answered while another drives."""
        told, told_ns = self._told
        if sentence != told or self.now_ns - told_ns >= REPEAT_NS:
            self._told = (sentence, self.now_ns)
            self.remark.publish(String(sentence))


def _share(value: float, limit: float) -> float:
    return min(1.0, max(-1.0, value / limit))


def _raiser(error: PageGoneError) -> Callable[[], None]:
    def fail() -> None:
        raise error

    return fail
