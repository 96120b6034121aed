"""Episodes of what a node finds repeatedly: one report when it begins, one when it changes, one at its end."""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec

from chefbot.causes.reports import END, SEVERITY
from chefbot.msgs.chefbot_msgs import Cause

HOLD_NS = 500_000_000
"""Time for which something must not be found any more before it has ended, ns; it flickers by single cycles."""
MIN_CHANGE_NS = 500_000_000
"""Minimum time between the reports of two findings of one check, ns; a stop after a slow-down never waits."""
SAME_PLACE_DISTANCE = 0.5
"""Distance up to which two obstacles are the same one, m: one seen from another side, or a person on the move."""


class _Open(NamedTuple):
    report: Cause
    began_ns: int
    seen_ns: int


class Episodes:
    """The episodes of one node, one at a time for each of its subjects, such as its motion or its path."""

    def __init__(self) -> None:
        self._open: dict[str, _Open] = {}
        self._waiting: dict[str, int] = {}

    def update(self, subject: str, found: Cause | None, now_ns: int, delay_ns: int = 0) -> list[Cause]:
        """Take what is found now, None for nothing, and return the reports that are due.

        delay_ns: time for which something must be found before its episode begins.
        """
        open_now = self._open.get(subject)
        if found is None:
            self._waiting.pop(subject, None)
            ended = open_now is not None and now_ns - open_now.seen_ns >= HOLD_NS
            return [self._end(subject)] if ended else []
        if open_now is not None and not _differs(open_now, found, now_ns):
            self._open[subject] = open_now._replace(seen_ns=now_ns)
            return []
        if now_ns - self._waiting.setdefault(subject, now_ns) < delay_ns:
            return []
        ending = [self._end(subject)] if open_now is not None else []
        self._open[subject] = _Open(found, now_ns, now_ns)
        return [*ending, found]

    @property
    def open_checks(self) -> tuple[str, ...]:
        """The checks whose episodes are open."""
        return tuple(one.report.check for one in self._open.values())

    def end_all(self) -> list[Cause]:
        """End all episodes, as at the end of a goal, and return their ends."""
        return [self._end(subject) for subject in list(self._open)]

    def _end(self, subject: str) -> Cause:
        self._waiting.pop(subject, None)
        return msgspec.structs.replace(self._open.pop(subject).report, kind=END)


def _differs(open_now: _Open, found: Cause, now_ns: int) -> bool:
    """Return whether what is found now is a different episode from the open one."""
    before = open_now.report
    if SEVERITY.get(found.kind, 0) > SEVERITY.get(before.kind, 0):
        return True
    if now_ns - open_now.began_ns < MIN_CHANGE_NS:
        return False
    return (found.kind, found.check) != (before.kind, before.check) or _elsewhere(before, found)


def _elsewhere(before: Cause, found: Cause) -> bool:
    if not (before.located and found.located):
        return before.located != found.located
    return math.hypot(found.point.x - before.point.x, found.point.y - before.point.y) > SAME_PLACE_DISTANCE
