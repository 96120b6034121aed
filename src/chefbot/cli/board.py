"""`chefbot board`: a board on this computer, and what a board says."""

from __future__ import annotations

import os
import sys
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
from chefbot.devices.board_ports import explain, explain_disconnection, open_port, ports
from chefbot.devices.serial_connection import AUTO
from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import wall_ns
from chefbot.sim.firmware import serve
from chefbot.storage.atomic_files import make_folder, os_errors_as_storage_errors

WINDOW = 1.0
"""Seconds that a rate is taken over."""
console = Console(highlight=False, soft_wrap=True)


def run_emulator(robot: str, link: Path) -> int:
    """The firmware, compiled for this computer, at a pty; it ends with Ctrl-C. Its exit code."""
    made_for = load_robot(robot)
    if not hasattr(os, "openpty"):
        raise UserError(
            "a board at a pty can be emulated on Linux and macOS only; `chefbot demo` has one inside"
        )
    make_folder(link.parent)
    _check_free(link)
    _leave_the_terminal_alone()
    console.print(
        "A motor board with motor model; what can happen to it goes to its standard input: "
        "estop 0|1, block WHEEL 0|1, cable WHEEL 0|1, battery MV, echo US, imu 0|1, hang, power. It speaks at:"
    )
    sys.stdout.flush()
    return serve(made_for, link)


def _check_free(link: Path) -> None:
    """A link that a board has left behind when it was killed leads nowhere, and is replaced."""
    if not link.exists():
        return
    if not link.is_symlink():
        raise UserError(f"{link} is there already and no link; choose another --link")
    raise UserError(
        f"{link} leads to {link.resolve()}, where another board may be: end it, remove the link, or choose "
        "another --link"
    )


def _leave_the_terminal_alone() -> None:
    """In the background, one that reads the terminal is halted by the next key that somebody types."""
    if sys.stdin is not None and sys.stdin.isatty() and os.tcgetpgrp(0) != os.getpgrp():
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)


def run_monitor(port: str, seconds: float) -> None:
    """A table that lives in a terminal, a line for each line elsewhere; `seconds` 0: until Ctrl-C."""
    with _opened(port) as opened:
        if console.is_terminal:
            _show_table(opened, seconds)
        else:
            for letter, words in _decoded(opened, seconds):
                if letter:
                    console.print(f"{letter}: {words}", markup=False)


def run_log(port: str, out: Path, seconds: float) -> None:
    """Each line as it came, behind the seconds since the start; bytes that do not print as \\x escapes."""
    count, splitter = 0, LineSplitter(longest=1000)
    make_folder(out.parent)
    with os_errors_as_storage_errors(out), _opened(port) as opened, _emptied(out) as file:
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


def _emptied(out: Path) -> TextIO:
    """Each line goes to the end: whoever empties the log while it is written finds no hole at its beginning."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND
    return os.fdopen(os.open(out, flags, 0o666), "w", encoding="ascii")


def _opened(port: str) -> serial.Serial:
    path = _only_port() if port == AUTO else port
    try:
        return open_port(path)
    except OSError as error:
        raise UserError(explain(path, error)) from None


def _only_port() -> str:
    found = ports()
    if len(found) != 1:
        named = ", ".join(port.path for port in found) or "none"
        raise UserError(f"say which port; there are: {named}")
    return found[0].path


def _chunks(opened: serial.Serial, seconds: float) -> Iterator[tuple[bytes, float]]:
    """What comes, and when, in seconds since the start; a board is asked who it is until it answers."""
    began = time.monotonic()
    probe = ProtocolProbe(os.getpid(), wall_ns())
    while seconds <= 0 or time.monotonic() - began < seconds:
        try:
            if probe.dialect is None and not probe.timed_out(wall_ns()):
                opened.write(probe.data_to_send(wall_ns()))
            data = opened.read(max(1, opened.in_waiting))
        except OSError as error:
            raise UserError(explain_disconnection(str(opened.port), error)) from None
        probe.hear(data, wall_ns())
        yield data, time.monotonic() - began


def _decoded(opened: serial.Serial, seconds: float) -> Iterator[tuple[str, str]]:
    """Kind and words of each line; two empty texts where nothing came."""
    splitter = LineSplitter()
    for data, _ in _chunks(opened, seconds):
        yield "", ""
        for raw in splitter.push(data):
            yield _words(raw)


def _words(raw: bytes) -> tuple[str, str]:
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
        for letter, words in _decoded(opened, seconds):
            if letter:
                newest[letter] = words
                counts[letter] += 1
            passed = time.monotonic() - since
            if passed >= WINDOW:
                rates = {kind: count / passed for kind, count in counts.items()}
                counts.clear()
                since = time.monotonic()
            if not letter:
                live.update(_table(str(opened.port), newest, rates), refresh=True)


def _table(port: str, newest: dict[str, str], rates: dict[str, float]) -> Table:
    table = Table("line", "a second", "says", title=port, box=None, title_justify="left")
    for letter in sorted(newest):
        table.add_row(letter, f"{rates.get(letter, 0.0):.1f}", newest[letter])
    return table
