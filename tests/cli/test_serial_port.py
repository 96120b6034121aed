"""`chefbot board monitor` and `log` at a pseudo-terminal, with the bytes of a board."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import pytest
from serial.tools import list_ports

from chefbot.board.framing import frame
from chefbot.cli.board import serial_port
from chefbot.cli.board.serial_port import opened_port, run_log, run_monitor
from chefbot.errors import ChefbotError, UserError

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
BRIEF = 0.12
"""Seconds: two reads."""


class Link(NamedTuple):
    """The board's end and the path of the computer's end."""

    board: int
    port: str


@pytest.fixture
def link() -> Iterator[Link]:
    board, port = os.openpty()
    yield Link(board, os.ttyname(port))
    for end in (board, port):
        os.close(end)


@pytest.fixture
def sending_link(link: Link, monkeypatch: pytest.MonkeyPatch) -> Link:
    """The board sends these bytes as soon as the port is open, whose opening discards what came before."""
    original = serial_port.open_port

    def open_and_send(path: str) -> object:
        opened = original(path)
        os.write(
            link.board,
            frame("b 1 100 12345") + b"nonsense \\ \xff\x01\n" + frame("t 2 100 7 0 0 68") + b"b 1",
        )
        return opened

    monkeypatch.setattr(serial_port, "open_port", open_and_send)
    return link


def test_each_line_is_logged_after_its_time_in_ascii(sending_link: Link, tmp_path: Path) -> None:
    out = tmp_path / "new" / "board.log"
    run_log(sending_link.port, out, BRIEF)
    rows = [line.split("\t") for line in out.read_text("ascii").splitlines()]
    assert [text for _, text in rows] == [
        frame("b 1 100 12345").decode().strip(), r"nonsense \\ \xff\x01", frame("t 2 100 7 0 0 68").decode().strip()
    ]  # fmt: skip
    times = [float(time) for time, _ in rows]
    assert times == sorted(times) and 0.0 <= times[0] < 10.0
    assert all(len(time.partition(".")[2]) == 6 for time, _ in rows)


def test_an_existing_log_is_replaced(sending_link: Link, tmp_path: Path) -> None:
    (tmp_path / "board.log").write_text("old\n" * 100)
    run_log(sending_link.port, tmp_path / "board.log", BRIEF)
    assert "old" not in (tmp_path / "board.log").read_text()


def test_a_log_that_cannot_be_written_has_one_sentence(link: Link, tmp_path: Path) -> None:
    with pytest.raises(ChefbotError, match=str(tmp_path)):
        run_log(link.port, tmp_path, BRIEF)


def test_lines_are_decoded_into_a_pipe(sending_link: Link, capsys: pytest.CaptureFixture[str]) -> None:
    run_monitor(sending_link.port, BRIEF)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("b battery: 12.3")
    assert lines[1] == r"? damaged: b'nonsense \\ \xff\x01'"
    assert lines[2].startswith("t time: up 7 s")
    assert len(lines) == 3, "an unfinished line is not shown"


def test_a_silent_port_ends_after_the_time(link: Link, capsys: pytest.CaptureFixture[str]) -> None:
    run_monitor(link.port, BRIEF)
    assert capsys.readouterr().out == ""


def test_a_port_that_does_not_open_is_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is not there"):
        opened_port(str(tmp_path / "none"))
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match="is not a serial port"):
        opened_port(str(tmp_path / "file"))


def test_auto_needs_exactly_one_port(link: Link, monkeypatch: pytest.MonkeyPatch) -> None:
    def plug(*paths: str) -> None:
        found = [
            SimpleNamespace(device=path, description="x", vid=0x2341, pid=1, serial_number=None)
            for path in paths
        ]
        monkeypatch.setattr(list_ports, "comports", lambda: found)

    plug()
    with pytest.raises(UserError, match="give the path of one of: none"):
        opened_port("auto")
    plug("/dev/ttyX0", "/dev/ttyX1")
    with pytest.raises(UserError, match="one of: /dev/ttyX0, /dev/ttyX1"):
        opened_port("auto")
    plug(link.port)
    with opened_port("auto") as opened:
        assert opened.port == link.port
