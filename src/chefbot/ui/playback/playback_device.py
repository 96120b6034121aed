"""The web UI of a recorded log: plays its messages, jumps in time, and commands no robot."""

from __future__ import annotations

import struct
from collections.abc import Iterable

import msgspec

from chefbot.causes.history import CauseHistory
from chefbot.errors import ChefbotError, UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.validity import check
from chefbot.runtime.node import In, every
from chefbot.runtime.recorded_log import LoggedMessage
from chefbot.storage.delivery_history import RecordedRound
from chefbot.ui import commands as do
from chefbot.ui.causes.cause_views import KEPT_CAUSES
from chefbot.ui.display import views
from chefbot.ui.display.message_conversion import RecentDiagnostics
from chefbot.ui.playback.log_player import LogPlayer
from chefbot.ui.web_ui import WebUiDevice

HZ = 20
MAX_STEP = 0.5
"""Longest time between two steps that counts, s: a busy computer plays more slowly instead of jumping."""
OF_THE_MOMENT = (
    "goal", "path", "local_path", "local_costmap", "candidates", "particles", "scan", "obstacles", "people", "camera",
    "delivery", "forecast", "mapping", "causes",
)  # fmt: skip
"""Layers that show one moment of the robot; what is latched, as the map, is not among them."""
ONLY_PLAYBACK = "This is a recording; no robot can be controlled here"


class PlaybackDevice(WebUiDevice):
    """Publishes the messages of `player` at its pace to itself; the operator pauses, jumps and sets the rate."""

    player = LogPlayer(())
    title = ""
    rate = 1.0

    def start(self) -> None:
        """Start the server; playback begins with the log."""
        super().start()
        self._saves_failures = False
        self.skipped = 0
        """Number of messages that could not be shown: of an unknown type, damaged, or with invalid values."""
        self._stepped_ns = self.now_ns
        self._publish_logged(self.player.jump(self.player.begin_ns))

    def _open_history(self, *, simulated: bool) -> tuple[RecordedRound, ...]:  # noqa: ARG002
        """Record nothing: what a recording shows is no new round of the robot."""
        return ()

    def _open_causes(self, *, simulated: bool) -> tuple[views.CauseView, ...]:  # noqa: ARG002
        """Record nothing."""
        return ()

    @every(hz=HZ)
    def step(self) -> None:
        """Publish what is due, and show the position."""
        elapsed = min(MAX_STEP * 1e9, self.now_ns - self._stepped_ns)
        self._stepped_ns = self.now_ns
        if self.rate:
            self._publish_logged(self.player.advance(self.player.now_ns + round(self.rate * elapsed)))
        if self.player.at_end:
            self.rate = 0.0
        self._show_position()

    def _show_position(self) -> None:
        player = self.player
        view = views.PlaybackView(
            time=round((player.now_ns - player.begin_ns) / 1e9, 1),
            length=round((player.end_ns - player.begin_ns) / 1e9, 1),
            rate=self.rate,
            title=self.title,
        )
        self._server.set_layer("playback", view)

    def _publish_logged(self, messages: Iterable[LoggedMessage]) -> None:
        for logged in messages:
            try:
                message = message_type(logged.kind).from_cdr(logged.data)
                check(message)
            except (ChefbotError, KeyError, ValueError, struct.error):
                self.skipped += 1
                continue
            self._loop.publish(logged.topic, message, "recording", from_device=True)

    def _receive(self, command: do.OperatorCommand, who: str) -> None:  # noqa: ARG002
        if not isinstance(command, do.Playback):
            raise UserError(ONLY_PLAYBACK)
        self.post(lambda: self._control(command))

    def _control(self, command: do.Playback) -> None:
        if command.time is not None:
            self._jump(self.player.begin_ns + round(command.time * 1e9))
        if command.rate is not None:
            if command.rate and command.time is None and self.player.at_end:
                self._jump(self.player.begin_ns)
            self.rate = command.rate
        self._show_position()

    def _jump(self, to_ns: int) -> None:
        """Forget what is shown, and show what was known at another time."""
        self.tf.clear()
        self._causes, self._diagnostics = CauseHistory(size=KEPT_CAUSES), RecentDiagnostics()
        self._stopped, self._mapping = False, views.MappingView()
        for port in vars(self).values():
            if isinstance(port, In):
                port.last = None
        for layer in OF_THE_MOMENT:
            self._server.set_layer(layer, None)
        self._show_stop()
        self._publish_logged(self.player.jump(to_ns))

    def _status(self, pose: SE2 | None) -> views.StatusView:
        clock = float(self.player.now_ns // 1_000_000_000)
        return msgspec.structs.replace(super()._status(pose), clock=clock, real_time_factor=None)
