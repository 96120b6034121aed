"""`chefbot board monitor` and `log`: the messages of a board at a serial port."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import serial
from rich.console import Console
from rich.live import Live
from rich.table import Table

from chefbot.board.autodetect import ProtocolProbe
from chefbot.board.chapter_messages import parse_chapter
from chefbot.board.framing import LineSplitter
from chefbot.board.messages import parse
from chefbot.board.pretty_print import describe, describe_chapter
from chefbot.devices.serial_ports import explain, explain_disconnection, open_port, ports
from chefbot.errors import UserError
from chefbot.robot.sensors import AUTO
from chefbot.runtime.clock import wall_ns
from chefbot.storage.atomic_files import make_folder, os_errors_as_storage_errors

WINDOW = 1.0
"""Period of the rate measurement, s."""
console = Console(highlight=False, soft_wrap=True)


def run_monitor(port: str, seconds: float) -> None:
    """Show a live table in a terminal, one line per message elsewhere; `seconds` 0: until Ctrl-C."""
    with opened_port(port) as opened:
        if console.is_terminal:
            _show_table(opened, seconds)
        else:
            for letter, text in _decoded(opened, seconds):
                if letter:
                    console.print(f"{letter}: {text}", markup=False)


def run_log(port: str, out: Path, seconds: float) -> None:
    """Log each received line after the seconds since the start, with \\x escapes for bytes that do not print."""
    count, splitter = 0, LineSplitter(longest=1000)
    make_folder(out.parent)
    with os_errors_as_storage_errors(out), opened_port(port) as opened, _opened_log(out) as file:
        console.print(f"Logging {opened.port} to {out}; Ctrl-C ends it.", markup=False)
        try:
            for data, at in _chunks(opened, seconds):
                for line in splitter.push(data):
                    file.write(
                        f"{at:.6f}\t{line.decode('latin-1').encode('unicode_escape').decode('ascii')}\n"
                    )
                    count += 1
                file.flush()
        finally:
            console.print(f"{count} lines in {out}", markup=False)


def _opened_log(out: Path) -> TextIO:
    """Open the empty log in append mode: truncated by another program, it gets no hole at its beginning."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND
    return os.fdopen(os.open(out, flags, 0o666), "w", encoding="ascii")


def opened_port(port: str) -> serial.Serial:
    """Open the port at a path, or the only port for `auto`. Raises UserError if that is not possible."""
    path = _only_port() if port == AUTO else port
    try:
        return open_port(path)
    except OSError as error:
        raise UserError(explain(path, error)) from None


def _only_port() -> str:
    found = ports()
    if len(found) != 1:
        paths = ", ".join(port.path for port in found) or "none"
        raise UserError(f"auto needs exactly one serial port; give the path of one of: {paths}")
    return found[0].path


def _chunks(opened: serial.Serial, seconds: float) -> Iterator[tuple[bytes, float]]:
    """Yield received bytes with seconds since the start; handshakes are sent until the board answers."""
    began = time.monotonic()
    probe = ProtocolProbe(os.getpid(), wall_ns())
    while seconds <= 0 or time.monotonic() - began < seconds:
        try:
            if probe.dialect is None and not probe.timed_out(wall_ns()):
                opened.write(probe.data_to_send(wall_ns()))
            data = opened.read(max(1, opened.in_waiting))
        except OSError as error:
            raise UserError(explain_disconnection(str(opened.port), error)) from None
        probe.receive_data(data, wall_ns())
        yield data, time.monotonic() - began


def _decoded(opened: serial.Serial, seconds: float) -> Iterator[tuple[str, str]]:
    """Yield kind and description of each line; two empty texts where nothing was received."""
    splitter = LineSplitter()
    for data, _ in _chunks(opened, seconds):
        yield "", ""
        for raw in splitter.push(data):
            yield _describe_line(raw)


def _describe_line(raw: bytes) -> tuple[str, str]:
    line = parse(raw)
    if line is not None:
        return describe(line)
    chapter = parse_chapter(raw)
    if chapter is not None:
        return describe_chapter(chapter)
    return "? damaged", repr(raw)


def _show_table(opened: serial.Serial, seconds: float) -> None:
    newest: dict[str, str] = {}
    counts: Counter[str] = Counter()
    rates: dict[str, float] = {}
    since = time.monotonic()
    with Live(console=console, auto_refresh=False, screen=False) as live:
        for letter, text in _decoded(opened, seconds):
            if letter:
                newest[letter] = text
                counts[letter] += 1
            passed = time.monotonic() - since
            if passed >= WINDOW:
                rates = {kind: count / passed for kind, count in counts.items()}
                counts.clear()
                since = time.monotonic()
            if not letter:
                live.update(_table(str(opened.port), newest, rates), refresh=True)


def _table(port: str, newest: dict[str, str], rates: dict[str, float]) -> Table:
    table = Table("message", "Hz", "content", title=port, box=None, title_justify="left")
    for letter in sorted(newest):
        table.add_row(letter, f"{rates.get(letter, 0.0):.1f}", newest[letter])
    return table
