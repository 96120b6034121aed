"""`chefbot why`: the causes of a run as lines, as JSON, and as a picture of the map."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.causes.history import CauseSpan, distinct_spans
from chefbot.causes.sentences import effect_word
from chefbot.cli.why.picture import write_picture
from chefbot.cli.why.run_log import RunCauses, find_log, read_run
from chefbot.plural import number_of

console = Console(highlight=False, markup=False, soft_wrap=True)
CLOCK_JUMP_NS = 1_000_000_000
"""Time by which a cause begins before the one listed above it only if the robot's clock has begun again, ns."""
EFFECT_NAMES = {"slow": "slow-down", "stop": "stop", "detour": "detour", "failure": "failure"}


def print_reasons(given: Path | None, last: int | None, as_json: bool, picture: Path | None) -> None:
    """Print the newest `last` causes of a run, all for None. Raises UserError if there are none."""
    run = read_run(find_log(given))
    spans = run.spans if as_json else distinct_spans(run.spans)
    hidden = 0 if last is None else max(len(spans) - last, 0)
    if as_json:
        for span in spans[hidden:]:
            console.print(_json(span))
    else:
        _print_lines(run, spans, hidden)
    if picture is not None:
        write_picture(picture, run, spans[hidden:])
        if not as_json:
            console.print(f"picture in {picture}")


def _print_lines(run: RunCauses, spans: list[CauseSpan], hidden: int) -> None:
    """Print the spans from the `hidden`th on, numbered from 1."""
    counts = Counter(span.cause.kind for span in spans)
    parts = [number_of(counts[kind], word) for kind, word in EFFECT_NAMES.items() if counts[kind]]
    console.print(f"{run.path}: {', '.join(parts)}")
    if run.cut:
        console.print(f"The log is not complete: {run.cut}")
    if hidden:
        console.print(f"({number_of(hidden, 'earlier cause')}; --all shows them)")
    before_ns = 0
    for i, span in enumerate(spans[hidden:], hidden + 1):
        if span.began_ns < before_ns - CLOCK_JUMP_NS:
            console.print("The robot was started again.")
        console.print(_line(i, span, run.began_ns))
        before_ns = span.began_ns


def _line(number: int, span: CauseSpan, began_ns: int) -> str:
    """Return a cause as a line: number, seconds since the begin, effect, duration, sentence."""
    duration = span.duration
    lasted = f" {duration:.1f} s" if duration else ""
    time = (span.began_ns - began_ns) / 1e9
    return f"{number:4} {time:8.1f} s  {effect_word(span.cause) + lasted:16}  {span.cause.sentence}"


def _json(span: CauseSpan) -> str:
    """Return the chain of a cause as JSON; times in seconds of the robot's clock, null for what is not known."""
    cause = span.cause
    place = (
        {"frame": cause.header.frame_id, "x": cause.point.x, "y": cause.point.y} if cause.located else None
    )
    content = {
        "id": cause.id,
        "time": span.began_ns / 1e9,
        "ended": None if span.ended_ns is None else span.ended_ns / 1e9,
        "kind": cause.kind,
        "node": cause.node,
        "check": cause.check,
        "place": place,
        "sensor": cause.sensor or None,
        "marked_at": cause.marked_at.ns / 1e9 if cause.marked_at.ns else None,
        "obstacle": cause.obstacle or None,
        "person": cause.person if cause.person >= 0 else None,
        "caused_by": cause.caused_by or None,
        "chain": cause.chain,
        "numbers": {number.name: {"value": number.value, "unit": number.unit} for number in cause.numbers},
        "sentence": cause.sentence,
    }
    return msgspec.json.encode(content).decode()
