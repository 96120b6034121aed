"""Dead-man switch of manual driving: a driver whose commands stop or who disconnects stops the robot."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from chefbot.errors import UserError
from chefbot.ui.commands import Drive

COMMAND_TIMEOUT = 0.3
"""Timeout without a drive command, s, after which the robot is stopped (the web UI repeats every 0.1 s)."""


class DeadManSwitch:
    """Allows one driver at a time; `forward` receives the driver's commands, and a zero command on timeout or
    disconnection."""

    def __init__(self, forward: Callable[[Drive], None]) -> None:
        self._forward = forward
        self._driver: Any = None
        self._timer: asyncio.TimerHandle | None = None

    @property
    def driver(self) -> Any:
        """The client that drives; None if nobody does."""
        return self._driver

    def drive(self, client: Any, command: Drive) -> None:
        """Process a client's drive command in the server's event loop; UserError while another client drives."""
        # Only the current driver may command motion; a stop of another client is ignored.
        if self._driver not in (None, client):
            if command.is_zero:
                return
            raise UserError("The robot is being driven in another browser; wait until it is released")
        if command.is_zero:
            self._release()
        else:
            self._hold(client)
        self._forward(command)

    def disconnect(self, client: Any) -> None:
        """Remove a disconnected client; if it was driving, the robot is stopped."""
        if client is self._driver:
            self._on_timeout()

    def _hold(self, client: Any) -> None:
        self._release()
        self._driver = client
        self._timer = asyncio.get_running_loop().call_later(COMMAND_TIMEOUT, self._on_timeout)

    def _release(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._driver = self._timer = None

    def _on_timeout(self) -> None:
        self._release()
        self._forward(Drive(0.0, 0.0))
