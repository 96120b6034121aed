"""The verbs about the motor board, as a user types them."""

from __future__ import annotations

import io
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path

import pytest
from tests.devices.emulated import Emulator
from tests.support.waiting import PATIENCE

from chefbot.board import parse
from chefbot.cli.app import main


@pytest.fixture
def emulated(tmp_path: Path) -> Iterator[Emulator]:
    with closing(Emulator(tmp_path)) as one:
        yield one


class Output(io.StringIO):
    """Standard output that calls `then` once it holds all the fragments."""

    def __init__(self, fragments: Sequence[str], then: Callable[[], None]) -> None:
        super().__init__()
        self._fragments, self._then = fragments, then

    def write(self, text: str) -> int:
        count = super().write(text)
        if self._fragments and all(fragment in self.getvalue() for fragment in self._fragments):
            self._fragments = ()
            self._then()
        return count


def run(monkeypatch: pytest.MonkeyPatch, *line: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", *line])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


@pytest.mark.slow
def test_the_monitor_decodes_every_line(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fragments = (
        "v handshake: chefbot protocol 1 on host",
        "e motion: ticks 0 0",
        "s status: waiting",
        "t time",
        "no session; no speed; neutral first",
    )
    monkeypatch.setattr(sys, "stdout", Output(fragments, lambda: signal.raise_signal(signal.SIGINT)))
    assert run(monkeypatch, "board", "monitor", str(emulated.path), "--seconds", f"{PATIENCE:g}") in (0, 130)
    assert all(fragment in sys.stdout.getvalue() for fragment in fragments)


@pytest.mark.slow
def test_the_log_contains_every_received_line(
    emulated: Emulator, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "logs" / "board.log"
    assert run(monkeypatch, "board", "log", str(emulated.path), "--out", str(out), "--seconds", "1") == 0
    pieces = [line.split("\t") for line in out.read_text().splitlines()]
    times = [float(time) for time, _ in pieces]
    whole = [parse(text.encode().decode("unicode_escape").encode("latin-1")) for _, text in pieces[1:]]
    assert len(whole) > 20 and None not in whole  # the first may be half a line
    assert times == sorted(times)


def test_an_unwritable_log_is_reported_in_one_sentence(
    emulated: Emulator, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    for out, reason in (
        ("/dev/full", "cannot be written: No space left on device"),
        (str(tmp_path), "cannot be written: Is a directory"),
        (str(tmp_path / "file" / "board.log"), "cannot be made: a file has its name"),
    ):
        assert run(monkeypatch, "board", "log", str(emulated.path), "--out", out, "--seconds", "20") == 2
        error = capsys.readouterr().err
        assert error.startswith("chefbot: ") and reason in error and error.count("\n") == 1


def test_switching_the_board_off_ends_the_monitor(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", Output(["e motion"], emulated.close))
    assert run(monkeypatch, "board", "monitor", str(emulated.path), "--seconds", f"{PATIENCE:g}") == 2
    error = capsys.readouterr().err
    assert "broke: its cable is unplugged, it is switched off" in error and error.count("\n") == 1


@pytest.mark.slow
def test_doctor_prints_a_udev_rule_without_world_access(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("chefbot.cli.board.ports.ports", list)
    assert run(monkeypatch, "doctor") == 0
    assert "udevadm" not in capsys.readouterr().out, "nothing is plugged in"
    assert run(monkeypatch, "doctor", "--all") == 0
    out = capsys.readouterr().out
    assert 'ATTRS{idVendor}=="2341"' in out and 'MODE="0660"' in out and "udevadm" in out
    assert "777" not in out and "0666" not in out


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (["board", "monitor", "/no/port"], "/no/port is not there"),
        (["board", "log", "/dev/null", "--out", "{tmp}/x"], "/dev/null is not a serial port"),
        (["board", "monitor", "{tmp}"], "is not a serial port"),
        (["board", "emulate", "--link", "{tmp}"], "exists already and is not a link"),
        (["board", "flash", "--board", "mege"], "did you mean 'mega'?"),
        (["board", "flash", "--board", "mega", "--robot", "chefbt"], "did you mean 'chefbot'?"),
        (["board", "image", "--board", "mega", "--robot", "no.yaml"], "no.yaml"),
    ],
)
def test_bad_input_is_reported_in_one_sentence(
    line: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(monkeypatch, *(argument.format(tmp=tmp_path) for argument in line)) == 2
    error = capsys.readouterr().err
    assert error.startswith("chefbot: ") and sentence in error and error.count("\n") == 1


def test_a_path_where_no_board_can_be_has_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "board", "emulate", "--link", "/proc/board") == 2
    assert capfd.readouterr().err == (
        "chefbot: the board cannot be at /proc/board: No such file or directory\n"
    )


def test_a_second_board_does_not_replace_the_first(
    emulated: Emulator, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "board", "emulate", "--link", str(emulated.path)) == 2
    assert f"{emulated.path} leads to /dev/pts/" in capsys.readouterr().err
    assert emulated.path.exists()
