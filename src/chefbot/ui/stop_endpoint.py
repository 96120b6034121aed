"""Presses of the emergency stop by HTTP, for a page whose web socket is dead: a request has its own connection."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from chefbot.errors import ChefbotError, UserError
from chefbot.ui.access.command_audit import CommandAudit
from chefbot.ui.access.token_bucket import TokenBucket
from chefbot.ui.access.visitors import Visitor
from chefbot.ui.commands import MAX_TEXT, OperatorCommand, Stop, parse_command
from chefbot.ui.files import SECURITY_HEADERS, plain_text

REQUESTS_PER_SECOND, BURST = 10.0, 20.0
"""Rate limit of the requests from one address, Hz, and how many may come at once; a page sends 8 per second."""
ONLY_STOP = "Only STOP is accepted here; other commands need the web socket."
MAX_ADDRESSES = 256
"""Number of addresses whose requests are counted; of more, the one that was silent longest is forgotten."""


class Sender(NamedTuple):
    """Who sent a request, for the audit log."""

    visitor: Visitor
    address: str


class StopEndpoint:
    """Passes presses of the emergency stop on as the web socket does; everybody who sees the robot can stop it."""

    def __init__(self, on_command: Callable[[OperatorCommand, str], None], audit: CommandAudit) -> None:
        self._on_command, self._audit = on_command, audit
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()

    async def serve(self, request: Request) -> Response:
        """Accept a command `stop` as JSON: 204. Anything else is refused with a sentence: 400, or 429 above the rate
        limit. The confirmation of the drive base comes with the layer `stop`."""
        sender = Sender(request.state.visitor, request.state.peer.host)
        if not self._within_rate_limit(sender.address):
            return plain_text("Too many presses of STOP from this address.", 429)
        try:
            body = await request.body()
        except ClientDisconnect:
            return Response(status_code=400)  # nobody receives it
        try:
            self._pass_on(sender, parse_command(body[:MAX_TEXT].decode(errors="replace")))
        except ChefbotError as error:
            return plain_text(str(error), 400)
        return Response(status_code=204, headers=SECURITY_HEADERS)

    def _pass_on(self, sender: Sender, command: OperatorCommand) -> None:
        if not isinstance(command, Stop):
            self._audit.command(sender, command, ONLY_STOP)
            raise UserError(ONLY_STOP)
        name, role = sender.visitor
        self._on_command(command, name or role)
        self._audit.command(sender, command, "")

    def _within_rate_limit(self, address: str) -> bool:
        now = asyncio.get_running_loop().time()
        bucket = self._buckets.pop(address, None) or TokenBucket(REQUESTS_PER_SECOND, BURST, now)
        self._buckets[address] = bucket
        if len(self._buckets) > MAX_ADDRESSES:
            self._buckets.popitem(last=False)
        return bucket.take(now)
