"""Slots for the clients of the web UI: who gets all layers and gives commands, and who may only press the emergency
stop."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from chefbot.ui.access.visitors import Role

C = TypeVar("C", bound=Hashable)

MAX_FULL_ACCESS = 16
"""Number of full-access slots."""
MAX_GUESTS = 8
"""Number of full-access slots that guests may take."""
MAX_ONLY_STOP = 16
"""Number of further slots, from which the robot can only be stopped; of their clients the oldest is replaced."""
MAX_ESTABLISHED = 8
"""Number of those whose clients are not replaced, as they have been there for ESTABLISHED_TIME."""
ESTABLISHED_TIME = 5.0
"""Time for which a client is there, and within which it has sent something, until it is established, s."""
ACTIVE_TIME = 60.0
"""Time after a command for which nobody else gets the slot of its sender, s."""


@dataclass
class _Slot:
    role: Role
    group: str
    since: float
    last_message: float
    full_access: bool
    active_until: float

    def is_established(self, now: float) -> bool:
        """Return whether its client has been there for a while and still sends something."""
        return now - self.since >= ESTABLISHED_TIME and now - self.last_message <= ESTABLISHED_TIME


class Admission(NamedTuple):
    """What changes when a client comes."""

    full_access: bool
    """Whether it gets a full-access slot."""
    demoted: tuple[Any, ...] = ()
    """Clients that from now on may only press the emergency stop."""
    dropped: tuple[Any, ...] = ()
    """Clients that are to be disconnected."""


@dataclass
class ClientSlots(Generic[C]):
    """Assigns slots to clients; times are in seconds of one monotonic clock.

    A client that gives commands and finds all full-access slots taken gets that of a guest, else of a client that
    gave no command for ACTIVE_TIME, from the largest group. Who loses one keeps the emergency stop.
    """

    _slots: dict[C, _Slot] = field(default_factory=dict)

    def admit(self, client: C, role: Role, group: str, now: float) -> Admission:
        """Give a new client a slot; `group` is that of its address and name."""
        demoted = self._make_room(role, now)
        full_access = self._is_room(role)
        self._slots[client] = _Slot(role, group, now, now, full_access, active_until=now)
        dropped = self._overflow(now)
        for other in dropped:
            del self._slots[other]
        return Admission(full_access, demoted, dropped)

    def remove(self, client: C) -> None:
        """Free the slot of a client."""
        self._slots.pop(client, None)

    def note_message(self, client: C, now: float) -> None:
        """Remember that a client has sent something."""
        if client in self._slots:
            self._slots[client].last_message = now

    def note_command(self, client: C, now: float) -> None:
        """Keep the slot of a client that has given a command."""
        if client in self._slots:
            self._slots[client].active_until = now + ACTIVE_TIME

    def _is_room(self, role: Role) -> bool:
        full_access = [slot for slot in self._slots.values() if slot.full_access]
        guests = sum(slot.role == "guest" for slot in full_access)
        return len(full_access) < MAX_FULL_ACCESS and (role != "guest" or guests < MAX_GUESTS)

    def _make_room(self, role: Role, now: float) -> tuple[C, ...]:
        """Take the full-access slot of a guest or of an idle client for one that gives commands; return that
        client."""
        if role == "guest" or self._is_room(role):
            return ()
        full_access = [client for client, slot in self._slots.items() if slot.full_access]
        replaceable = [
            client
            for client in full_access
            if self._slots[client].role == "guest" or self._slots[client].active_until <= now
        ]
        if not replaceable:
            return ()
        demoted = self._first_to_go(replaceable, full_access)
        self._slots[demoted].full_access = False
        return (demoted,)

    def _overflow(self, now: float) -> tuple[C, ...]:
        """Return the client that has to go if too many have no full access."""
        only_stop = [client for client, slot in self._slots.items() if not slot.full_access]
        if len(only_stop) <= MAX_ONLY_STOP:
            return ()
        established = [client for client in only_stop if self._slots[client].is_established(now)]
        kept = {
            *established[:MAX_ESTABLISHED],
            only_stop[-1],
        }  # the newest one may give commands and need it
        return (self._first_to_go([client for client in only_stop if client not in kept], only_stop),)

    def _first_to_go(self, candidates: list[C], counted: list[C]) -> C:
        """Return a guest if there is one, from the group that is the largest among `counted`, the oldest."""
        counts = Counter(self._slots[client].group for client in counted)
        return max(
            candidates,
            key=lambda client: (self._slots[client].role == "guest", counts[self._slots[client].group]),
        )
