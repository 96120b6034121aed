"""Places of the web UI: who gets all layers and gives commands, and who may only press the emergency stop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from chefbot.ui.access.visitors import Role

C = TypeVar("C", bound=Hashable)

MAX_FULL = 16
"""Number of full places."""
MAX_GUESTS = 8
"""Number of full places that guests may take."""
MAX_RESERVED = 16
"""Number of further places, from which the robot can only be stopped; of their holders the oldest is replaced."""
MAX_ESTABLISHED = 8
"""Number of those whose holders are not replaced, as they have been there for ESTABLISHED_TIME."""
ESTABLISHED_TIME = 5.0
"""Time for which a client is there, and has sent something at least as recently, until it is established, s."""
ACTIVE_TIME = 60.0
"""Time after a command for which nobody else gets the place of its sender, s."""


@dataclass
class _Holder:
    role: Role
    group: str
    since: float
    last_message: float
    full: bool
    active_until: float

    def is_established(self, now: float) -> bool:
        """Return whether it has been there for a while and still sends something."""
        return now - self.since >= ESTABLISHED_TIME and now - self.last_message <= ESTABLISHED_TIME


class Seating(NamedTuple):
    """What changes when a client comes."""

    full: bool
    """Whether it gets a full place."""
    demoted: tuple[Any, ...] = ()
    """Clients that from now on may only press the emergency stop."""
    dropped: tuple[Any, ...] = ()
    """Clients that are to be disconnected."""


@dataclass
class ClientPlaces(Generic[C]):
    """Assigns places to clients; times are in seconds of one monotonic clock.

    A client that gives commands and finds all places taken gets the place of a guest, else of a client that gave no
    command for ACTIVE_TIME, from the group that holds the most. Who loses a full place keeps the emergency stop.
    """

    _holders: dict[C, _Holder] = field(default_factory=dict)

    def add(self, client: C, role: Role, group: str, now: float) -> Seating:
        """Give a new client a place; `group` is that of its address and name."""
        demoted = self._make_room(role, now)
        full = self._is_room(role)
        self._holders[client] = _Holder(role, group, now, now, full, active_until=now)
        dropped = self._overflow(now)
        for other in dropped:
            del self._holders[other]
        return Seating(full, demoted, dropped)

    def remove(self, client: C) -> None:
        """Free the place of a client."""
        self._holders.pop(client, None)

    def note_message(self, client: C, now: float) -> None:
        """Remember that a client has sent something."""
        if client in self._holders:
            self._holders[client].last_message = now

    def note_command(self, client: C, now: float) -> None:
        """Keep the place of a client that has given a command."""
        if client in self._holders:
            self._holders[client].active_until = now + ACTIVE_TIME

    def _is_room(self, role: Role) -> bool:
        full = [holder for holder in self._holders.values() if holder.full]
        guests = sum(holder.role == "guest" for holder in full)
        return len(full) < MAX_FULL and (role != "guest" or guests < MAX_GUESTS)

    def _make_room(self, role: Role, now: float) -> tuple[C, ...]:
        """Take the full place of a guest or of an idle client for one that gives commands; return that client."""
        if role == "guest" or self._is_room(role):
            return ()
        full = [client for client, holder in self._holders.items() if holder.full]
        replaceable = [
            client
            for client in full
            if self._holders[client].role == "guest" or self._holders[client].active_until <= now
        ]
        if not replaceable:
            return ()
        demoted = self._first_to_go(replaceable, full)
        self._holders[demoted].full = False
        return (demoted,)

    def _overflow(self, now: float) -> tuple[C, ...]:
        """Return the client that has to go if too many have no full place."""
        reserved = [client for client, holder in self._holders.items() if not holder.full]
        if len(reserved) <= MAX_RESERVED:
            return ()
        established = [client for client in reserved if self._holders[client].is_established(now)]
        kept = {
            *established[:MAX_ESTABLISHED],
            reserved[-1],
        }  # the newest one may give commands and need it
        return (self._first_to_go([client for client in reserved if client not in kept], reserved),)

    def _first_to_go(self, candidates: list[C], counted: list[C]) -> C:
        """Return a guest if there is one, of the group that has the most of the `counted`, the oldest."""
        counts = Counter(self._holders[client].group for client in counted)
        return max(
            candidates,
            key=lambda client: (self._holders[client].role == "guest", counts[self._holders[client].group]),
        )
