"""What of the clients' commands is recorded in the audit log: presses once, driving as begin and end."""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

import msgspec

from chefbot.ui.access.audit_log import AuditLog, Kind
from chefbot.ui.access.visitors import Visitor
from chefbot.ui.client import BrowserConnection
from chefbot.ui.commands import Drive, Inspect, OperatorCommand, ReleaseStop, Stop, Withdraw

CONNECTION_ACTIONS = CONNECTED, DISCONNECTED = "connected", "disconnected"
"""Actions of the entries of clients that connect and disconnect."""
MAX_IDS = 64
"""Number of presses of the emergency stop whose repetitions are recognized."""


class CommandSender(Protocol):
    """Who gave a command, over a web socket or by one request."""

    @property
    def visitor(self) -> Visitor: ...

    @property
    def address(self) -> str: ...


class CommandAudit:
    """Records the clients of a web UI in `log`, or nothing if it is None."""

    def __init__(self, log: AuditLog | None) -> None:
        self._log = log
        self._driver: BrowserConnection | None = None
        self._presses: deque[str] = deque(maxlen=MAX_IDS)

    def connected(self, client: BrowserConnection) -> None:
        """Record that a client connected."""
        self._record(Kind.CONNECTION, client, CONNECTED, {"only_stop": True} if client.only_stop else {})

    def disconnected(self, client: BrowserConnection) -> None:
        """Record that a client disconnected."""
        self._record(Kind.CONNECTION, client, DISCONNECTED)

    def driver(self, driver: BrowserConnection | None) -> None:
        """Record that a client begins or ends to drive, when `driver` differs from the last one."""
        previous, self._driver = self._driver, driver
        if previous is driver:
            return
        if previous is not None:
            self._record(Kind.COMMAND, previous, "drive ended")
        if driver is not None:
            self._record(Kind.COMMAND, driver, "drive")

    def command(self, client: CommandSender, command: OperatorCommand, refusal: str) -> None:
        """Record a command, and why it was refused if it was; a repeated press of the emergency stop only once."""
        looks = isinstance(command, Inspect) or getattr(command, "preview", False)
        if looks or (isinstance(command, Drive) and not refusal):
            return  # looking changes nothing; driving is recorded by `driver`; both are repeated all the while
        if isinstance(command, Stop) and command.id:
            if command.id in self._presses:
                return
            self._presses.append(command.id)
        kind = Kind.SAFETY if isinstance(command, Stop | Withdraw | ReleaseStop) else Kind.COMMAND
        details = msgspec.to_builtins(command)
        details.pop("pin", None)
        self._record(kind, client, details.pop("do"), details, refusal)

    def _record(
        self,
        kind: Kind,
        client: CommandSender,
        action: str,
        details: dict[str, Any] | None = None,
        refusal: str = "",
    ) -> None:
        if self._log is not None:
            name, role = client.visitor
            self._log.record(kind, (name, role, client.address), action, details or {}, refusal)
