"""Which fault events are active: those of a list begin and end by the clock, others on request."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

import msgspec

from chefbot.config import ConfigError, build
from chefbot.errors import UserError
from chefbot.sim.faults.events import KINDS, FaultEvent, InjectedFault, LastingFault

F = TypeVar("F", bound=InjectedFault)
TARGETS = ("sensor", "wheel", "node", "link", "clock")
"""Keys that name what a fault hits."""
NONE = "none"
"""Word of a request that ends faults."""


def to_ns(seconds: float) -> int:
    """Return a time of the simulation in nanoseconds."""
    return round(seconds * 1e9)


def name_of(event: InjectedFault) -> str:
    """Return the word of a fault, such as `freeze`."""
    return str(event.__struct_config__.tag)


def target_of(event: InjectedFault) -> str:
    """Return what a fault hits, such as `lidar`; empty where its word implies it."""
    return next((str(value) for key in TARGETS if (value := getattr(event, key, ""))), "")


def describe(event: InjectedFault) -> str:
    """Return a fault in words, such as `freeze of lidar`."""
    target = target_of(event)
    return f"{name_of(event)} of {target}" if target else name_of(event)


def begin_sentence(event: InjectedFault) -> str:
    """Return the notice at the beginning of a fault."""
    until = getattr(event, "until", None)
    end = "" if until is None else f", until {until:g} s"
    return f"Fault begins: {describe(event)}{_strength(event)}{end}."


def end_sentence(event: InjectedFault) -> str:
    """Return the notice at the end of a fault."""
    return f"Fault ends: {describe(event)}."


def _strength(event: InjectedFault) -> str:
    keys = [key for key in event.__struct_fields__ if key not in ("at", "until", *TARGETS)]
    values = [
        f"{key} {_text(value)}" for key in keys if (value := getattr(event, key)) not in (None, 0.0, ())
    ]
    return f" ({', '.join(values)})" if values else ""


def _text(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


class FaultSchedule(Generic[F]):
    """Begins and ends fault events in the order of their times.

    on_begin, on_end: called with each event; after a UserError of on_begin the event is not active. notice: called
    with a sentence about each begin and end.
    """

    def __init__(
        self,
        events: Iterable[F],
        on_begin: Callable[[F], None],
        on_end: Callable[[F], None],
        notice: Callable[[str], None],
    ) -> None:
        self._waiting = sorted(events, key=lambda event: event.at)
        self._on_begin, self._on_end, self._notice = on_begin, on_end, notice
        self.active: list[F] = []

    def times_ns(self) -> list[int]:
        """Return the times at which events begin or end."""
        ends = [end for event in self._waiting if (end := getattr(event, "until", None)) is not None]
        return sorted({to_ns(time) for time in [*(event.at for event in self._waiting), *ends]})

    def advance(self, now_ns: int) -> None:
        """End, then begin, all events that are due."""
        for event in [event for event in self.active if _has_ended(event, now_ns)]:
            self.end(event)
        while self._waiting and to_ns(self._waiting[0].at) <= now_ns:
            event = self._waiting.pop(0)
            if not _has_ended(event, now_ns):
                self.begin(event)

    def begin(self, event: F) -> None:
        """Begin an event now; if that is impossible, a notice gives the reason."""
        lasting = isinstance(event, LastingFault)
        if lasting:
            self.active.append(event)
        try:
            self._on_begin(event)
        except UserError as error:
            if lasting:
                self.active.remove(event)
            self._notice(f"Fault impossible: {describe(event)}: {error}.")
        else:
            self._notice(begin_sentence(event))

    def end(self, event: F) -> None:
        """End an active event now."""
        self.active.remove(event)
        self._on_end(event)
        self._notice(end_sentence(event))

    def end_all(self, target: str = "") -> None:
        """End all active events that hit `target`, or all of them."""
        for event in [event for event in self.active if target in ("", target_of(event))]:
            self.end(event)


def _has_ended(event: InjectedFault, now_ns: int) -> bool:
    until = getattr(event, "until", None)
    return until is not None and to_ns(until) <= now_ns


def parse_request(text: str, now_ns: int) -> FaultEvent | str:
    """Parse an operator's request: `FAULT [TARGET] [KEY=VALUE ...]`, which begins now, or `none [TARGET]`.

    Return the event, or the target whose faults are to end (empty: of all). UserError for anything else.
    """
    word, *others = text.split()[:10] or [""]
    positional = [other for other in others if "=" not in other]
    if word == NONE:
        return positional[0] if positional else ""
    plain: dict[str, Any] = {"fault": word, "at": now_ns / 1e9}
    fields = {str(kind.__struct_config__.tag): kind.__struct_fields__ for kind in KINDS}.get(word, ())
    target = next((key for key in TARGETS if key in fields), "")
    if positional and target:
        plain[target] = positional[0]
    for key, _, value in (other.partition("=") for other in others if "=" in other):
        plain[key] = _number_or_text(value)
    try:
        return build(plain, FaultEvent, f"request {text!r:.60}")  # type: ignore[arg-type]
    except ConfigError as error:
        raise UserError(str(error)) from None


def _number_or_text(value: str) -> float | str:
    try:
        return float(value)
    except ValueError:
        return value


def to_plain(events: Iterable[InjectedFault]) -> list[dict[str, Any]]:
    """Return events as a launch file has them."""
    plain: list[dict[str, Any]] = [msgspec.to_builtins(event) for event in events]
    return plain
