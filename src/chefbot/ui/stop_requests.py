"""Presses of STOP on their way to the base: which of them count, and which it has latched."""

from __future__ import annotations

from collections import deque

REMEMBERED = 32
"""Presses that are known by their id: a late copy of one of them changes nothing."""


class Presses:
    """A page repeats a press, with the same id, until it is confirmed: the base has latched STOP since it came."""

    def __init__(self) -> None:
        self._waiting: dict[str, None] = {}
        self._confirmed: deque[str] = deque(maxlen=REMEMBERED)
        self._withdrawn: deque[str] = deque(maxlen=REMEMBERED)

    @property
    def confirmed(self) -> tuple[str, ...]:
        """By id, the newest last."""
        return tuple(self._confirmed)

    @property
    def waiting(self) -> bool:
        """Whether the base has still to latch one."""
        return bool(self._waiting)

    def press(self, key: str, *, stopped: bool) -> bool:
        """Whether it is a press that still counts; `stopped`: the base has latched STOP already. "" has no copies."""
        if key and (key in self._confirmed or key in self._withdrawn):
            return False
        self._waiting[key] = None
        if stopped:
            self.latched()
        return True

    def latched(self) -> None:
        """The base says that it is stopped."""
        self._confirmed.extend(key for key in self._waiting if key)
        self._waiting.clear()

    def withdraw(self, key: str) -> None:
        """It shall not count when it comes, unless the base has it."""
        self._waiting.pop(key, None)
        self._withdrawn.append(key)

    def clear(self) -> None:
        """STOP was released. A press that nobody has confirmed comes again from its page, and counts then."""
        self._waiting.clear()
