"""`chefbot replay --show`: a recorded log, such as an incident, in the web UI."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from rich.console import Console

from chefbot.devices.state_files import VARIABLE
from chefbot.errors import UserError
from chefbot.incidents.files import Incident
from chefbot.launcher.session import announce, print_fault
from chefbot.runtime.clock import WallClock
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Context
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import RecordedLog
from chefbot.signals import stop_on_signals
from chefbot.ui.browser import open_browser
from chefbot.ui.playback.log_player import LogPlayer
from chefbot.ui.playback.playback_device import PlaybackDevice
from chefbot.ui.web_ui_params import WebUiParams

console = Console(highlight=False, soft_wrap=True)


def show_log(log: RecordedLog, path: Path, incident: Incident | None, port: int) -> int:
    """Serve the web UI with the messages of a log until Ctrl-C; what it would keep goes to a temporary folder."""
    player = LogPlayer(log.messages)
    if player.at_end:
        raise UserError(f"log {path} contains no messages to show")
    with tempfile.TemporaryDirectory(prefix="chefbot-replay-") as folder:
        os.environ[VARIABLE] = folder
        _serve(log, player, title_of(path, incident), port)
    return 0


def title_of(path: Path, incident: Incident | None) -> str:
    """Return what the web UI calls a recording."""
    if incident is None:
        return path.name
    by = f", saved by {incident.by}" if incident.by else ""
    when = incident.time.replace("T", " ").replace("Z", " UTC")
    return f"Incident of {incident.robot}, {when}{by}: {incident.sentence or 'no reason given'}"


def _serve(log: RecordedLog, player: LogPlayer, title: str, port: int) -> None:
    system = NodeContainer(Loop(WallClock(), time.time_ns()), log.robot, log.seed)
    system.isolate_faults(print_fault)
    context = Context("page", system.loop, log.robot, system.transforms, log.seed)
    device = PlaybackDevice(context, WebUiParams(port=port))
    device.player, device.title = player, title
    device.start()
    console.print(title, markup=False)
    announce(console, [device])
    open_browser(device.url)
    try:
        with stop_on_signals(system.loop.stop):
            system.loop.run()
    finally:
        device.stop()
    if device.skipped:
        console.print(f"{device.skipped} messages could not be shown.")
