"""Causes over time: which of them hold now, and how long each of a run lasted."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from chefbot.causes.reports import END, FAILURE, SEVERITY
from chefbot.msgs.chefbot_msgs import Cause


class CauseSpan(NamedTuple):
    """A cause and the time at which it ended, ns; None while it holds. A failure ends at once."""

    cause: Cause
    ended_ns: int | None

    @property
    def began_ns(self) -> int:
        """Time at which the cause began, ns."""
        return self.cause.header.stamp.ns

    @property
    def duration(self) -> float | None:
        """How long it lasted, s, or None."""
        return None if self.ended_ns is None else (self.ended_ns - self.began_ns) / 1e9


class CauseHistory:
    """The newest causes, oldest first; `size` of them at most, all for None."""

    def __init__(self, causes: Iterable[Cause] = (), size: int | None = None) -> None:
        self._spans: dict[int, CauseSpan] = {}
        self._size = size
        for cause in causes:
            self.process(cause)

    def process(self, cause: Cause) -> None:
        """Add a cause, or the end of one."""
        if cause.kind == END:
            begun = self._spans.get(cause.id)
            if begun is not None:
                self._spans[cause.id] = begun._replace(ended_ns=cause.header.stamp.ns)
            return
        self._spans[cause.id] = CauseSpan(cause, cause.header.stamp.ns if cause.kind == FAILURE else None)
        if self._size is not None and len(self._spans) > self._size:
            del self._spans[min(self._spans)]

    @property
    def spans(self) -> list[CauseSpan]:
        """The causes with their ends, oldest first."""
        return list(self._spans.values())

    @property
    def sentence(self) -> str:
        """The sentence of the cause that holds now, empty if there is none."""
        present = self.present
        return "" if present is None else present.sentence

    @property
    def present(self) -> Cause | None:
        """The cause that holds now: of several the newest of the most severe ones; None if there is none."""
        holding = [span.cause for span in self._spans.values() if span.ended_ns is None]
        return max(holding, key=lambda one: (SEVERITY.get(one.kind, 0), one.id), default=None)
