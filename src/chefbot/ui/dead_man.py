"""Driving by hand needs a hand: who falls silent or leaves lets go of the stick."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from chefbot.errors import UserError
from chefbot.ui.commands import Drive

SILENCE = 0.3
"""Seconds without a drive command after which the robot is told to stand (the page repeats every 0.1 s)."""


class DeadMan:
    """One driver at a time; `forward` gets the driver's commands and a zero as soon as the driver is gone."""

    def __init__(self, forward: Callable[[Drive], None]) -> None:
        self._forward = forward
        self._driver: Any = None
        self._timer: asyncio.TimerHandle | None = None

    def drive(self, client: Any, command: Drive) -> None:
        """A drive command of a client, in the page's event loop; UserError while another client drives."""
        if self._driver not in (None, client):
            if command.still:
                return
            raise UserError("Someone else is driving the robot on another screen; wait until they let go")
        if command.still:
            self._let_go()
        else:
            self._hold(client)
        self._forward(command)

    def leave(self, client: Any) -> None:
        """The client is gone; if it was driving, the robot is told to stand."""
        if client is self._driver:
            self._expire()

    def _hold(self, client: Any) -> None:
        self._let_go()
        self._driver = client
        self._timer = asyncio.get_running_loop().call_later(SILENCE, self._expire)

    def _let_go(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._driver = self._timer = None

    def _expire(self) -> None:
        self._let_go()
        self._forward(Drive(0.0, 0.0))
