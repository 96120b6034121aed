"""Presses of the emergency stop: which of them are pending, confirmed or withdrawn."""

from __future__ import annotations

from collections import deque

MAX_IDS = 32
"""Number of presses whose id is kept: a late copy of one of them is ignored."""


class StopPresses:
    """Set of presses. A browser repeats a press, with the same id, until the drive base has latched the
    emergency stop."""

    def __init__(self) -> None:
        self._pending: dict[str, None] = {}
        self._confirmed: deque[str] = deque(maxlen=MAX_IDS)
        self._withdrawn: deque[str] = deque(maxlen=MAX_IDS)

    @property
    def confirmed(self) -> tuple[str, ...]:
        """Ids of confirmed presses, the newest last."""
        return tuple(self._confirmed)

    @property
    def waiting(self) -> bool:
        """Whether a press is not confirmed yet."""
        return bool(self._pending)

    def press(self, key: str, *, stopped: bool) -> bool:
        """Add a press and return whether it is new; `stopped`: the stop is latched already. A press with the
        id "" is always new."""
        if key and (key in self._confirmed or key in self._withdrawn):
            return False
        self._pending[key] = None
        if stopped:
            self.latched()
        return True

    def latched(self) -> None:
        """Confirm all pending presses: the drive base is stopped."""
        self._confirmed.extend(key for key in self._pending if key)
        self._pending.clear()

    def withdraw(self, key: str) -> None:
        """Withdraw a press that is not confirmed; it is also ignored if it is received later."""
        self._pending.pop(key, None)
        self._withdrawn.append(key)

    def clear(self) -> None:
        """Discard pending presses at a release. An unconfirmed press is repeated by its browser, and counts
        then."""
        self._pending.clear()
