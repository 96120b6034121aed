"""Causes over time: which of them hold now, and how long each of a run lasted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import msgspec

from chefbot.causes.reports import END, FAILURE, LATENESS_NS, SEVERITY
from chefbot.msgs.chefbot_msgs import Cause, PresentCauses


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
        self._spans: list[CauseSpan] = []
        self._size = size
        for cause in causes:
            self.process(cause)

    def process(self, cause: Cause) -> None:
        """Add a cause, or the end of one."""
        now_ns = cause.header.stamp.ns
        if cause.kind == END:
            self._end(lambda holding: holding.id == cause.id, now_ns)
            return
        if self._spans and cause.id <= self._spans[-1].cause.id:
            # The node that numbers them was restarted and will end none of those before.
            self._end(lambda _: True, now_ns)
        self._spans.append(CauseSpan(cause, now_ns if cause.kind == FAILURE else None))
        if self._size is not None:
            del self._spans[: -self._size]

    def lost_ends(self, present: PresentCauses) -> list[Cause]:
        """Return the ends of the causes that hold here, but are not in the list of those that do."""
        header, ids = present.header, frozenset(present.ids.tolist())
        return [
            msgspec.structs.replace(span.cause, header=header, kind=END)
            for span in self._spans
            if span.ended_ns is None
            and span.cause.id not in ids
            and header.stamp.ns - span.began_ns > LATENESS_NS
        ]

    def _end(self, ends: Callable[[Cause], bool], now_ns: int) -> None:
        """End those of the causes that hold for which `ends` is true."""
        self._spans = [
            span._replace(ended_ns=now_ns) if span.ended_ns is None and ends(span.cause) else span
            for span in self._spans
        ]

    @property
    def spans(self) -> list[CauseSpan]:
        """The causes with their ends, oldest first."""
        return list(self._spans)

    @property
    def sentence(self) -> str:
        """The sentence of the cause that holds now, empty if there is none."""
        present = self.present
        return "" if present is None else present.sentence

    @property
    def present(self) -> Cause | None:
        """The cause that holds now: of several the newest of the most severe ones; None if there is none."""
        holding = [span.cause for span in self._spans if span.ended_ns is None]
        return max(holding, key=lambda one: (SEVERITY.get(one.kind, 0), one.id), default=None)


def distinct_spans(spans: Sequence[CauseSpan]) -> list[CauseSpan]:
    """Return the spans without those of which a more severe one has the same sentence at the same time.

    When one node stands because of what another one reports, both report it.
    """
    by_sentence: dict[str, list[CauseSpan]] = {}
    for span in spans:
        by_sentence.setdefault(span.cause.sentence, []).append(span)
    return [
        span
        for span in spans
        if not any(_outweighs(other, span) for other in by_sentence[span.cause.sentence])
    ]


def _outweighs(one: CauseSpan, other: CauseSpan) -> bool:
    """Return whether `one` is more severe than `other`, or reported before it, and overlaps it in time."""
    severity, other_severity = SEVERITY.get(one.cause.kind, 0), SEVERITY.get(other.cause.kind, 0)
    before = severity == other_severity and one.cause.id < other.cause.id
    overlap = _ends_after(one, other.began_ns) and _ends_after(other, one.began_ns)
    return overlap and (severity > other_severity or before)


def _ends_after(span: CauseSpan, time_ns: int) -> bool:
    return span.ended_ns is None or span.ended_ns >= time_ns
