"""Causes as the web UI shows them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from chefbot.causes.history import CauseHistory, CauseSpan
from chefbot.causes.sentences import effect_word
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.storage.cause_records import Picture, RecordedCause
from chefbot.ui.display.views import CauseView

SHOWN_CAUSES = 24
"""Number of causes that the web UI shows, the newest, of this run and of earlier ones."""
KEPT_CAUSES = 10 * SHOWN_CAUSES
"""Number of causes of this run that are kept: several may be one entry."""


def place_on_map(cause: Cause) -> tuple[float, float] | None:
    """Return where the obstacle of a cause is on the map, m; None if there is none or it is not known."""
    is_known = cause.located and cause.header.frame_id == "map"
    return (cause.point.x, cause.point.y) if is_known else None


class HistoryEntry(NamedTuple):
    """The entry of a cause in the robot's history: its number, 0 for none, and its pictures."""

    number: int = 0
    pictures: tuple[Picture, ...] = ()


def cause_views(history: CauseHistory, entries: Mapping[int, HistoryEntry]) -> tuple[CauseView, ...]:
    """Return why the robot slowed down, stopped, took a detour or failed, the newest first.

    `entries`: those of recorded causes, by `id`; of causes with one entry only the newest is shown.
    """
    views = [
        _cause_view(span, entries.get(span.cause.id, HistoryEntry())) for span in reversed(history.spans)
    ]
    seen = [view.number for view in views]
    return tuple(view for i, view in enumerate(views) if not view.number or view.number not in seen[:i])


def _cause_view(span: CauseSpan, entry: HistoryEntry) -> CauseView:
    cause = span.cause
    x, y = place_on_map(cause) or (None, None)
    return CauseView(
        id=cause.id,
        number=entry.number,
        pictures=entry.pictures,
        time=span.began_ns / 1e9,
        ended=None if span.ended_ns is None else span.ended_ns / 1e9,
        effect=effect_word(cause),
        sentence=cause.sentence,
        chain=cause.chain,
        x=x,
        y=y,
    )


def recorded_cause_views(causes: Sequence[RecordedCause]) -> tuple[CauseView, ...]:
    """Return recorded causes of earlier runs; each has ended, at the latest with its run."""
    return tuple(
        CauseView(
            id=0,
            number=cause.number,
            pictures=cause.pictures,
            began=cause.began,
            time=0.0,
            ended=cause.duration or 0.0,
            effect=cause.effect,
            sentence=cause.sentence,
            chain=cause.chain,
            x=cause.x,
            y=cause.y,
        )
        for cause in causes
    )
