"""`chefbot board check`: whether a motor board answers at a serial port, and with which protocol."""

from __future__ import annotations

import os

from rich.console import Console

from chefbot.board.autodetect import ProtocolProbe
from chefbot.cli.board.serial_port import opened_port
from chefbot.devices.serial_ports import explain_disconnection
from chefbot.errors import UserError
from chefbot.runtime.clock import wall_ns

PROTOCOLS = {
    "board": "a motor board with chefbot's firmware",
    "chapter": "a motor board with the firmware of the book chapter, which has no checksum and no watchdog; "
    "`chefbot board flash` replaces it",
}
console = Console(highlight=False, soft_wrap=True, markup=False)


def check_board(port: str) -> int:
    """Detect the board's protocol. Returns the exit code: 1 if nothing answers within the detection timeout."""
    probe = ProtocolProbe(os.getpid(), wall_ns())
    with opened_port(port) as opened:
        try:
            while probe.dialect is None and not probe.timed_out(wall_ns()):
                opened.write(probe.data_to_send(wall_ns()))
                probe.receive_data(opened.read(max(1, opened.in_waiting)), wall_ns())
        except OSError as error:
            raise UserError(explain_disconnection(str(opened.port), error)) from None
        answer = PROTOCOLS[probe.dialect] if probe.dialect else probe.failure_reason
        console.print(f"{opened.port}: {answer}")
    return 0 if probe.dialect else 1
