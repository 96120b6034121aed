"""How a command ends: one sentence for bad input, the exit code, and an output that cannot be written."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from pathlib import Path

import pytest

from chefbot.cli.error_handling import choose_kernel_folder, user_errors_reported
from chefbot.errors import ChefbotError, UserError

FULL = Path("/dev/full")


def end_of(error: BaseException | None) -> int | str | None:
    """The exit code of a command that raises `error`."""
    with pytest.raises(SystemExit) as end, user_errors_reported():
        if error is not None:
            raise error
        raise SystemExit(0)
    return end.value.code


@contextmanager
def closed_pipe() -> Iterator[None]:
    """Standard output is a pipe whose reader has ended, as in `chefbot ... | head -0`."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as file, redirect_stdout(file):
        file.write("a line")
        yield


class OwnError(ChefbotError):
    """An error of some package."""


@pytest.mark.parametrize(
    "error", [ChefbotError("no such thing"), UserError("no such thing"), OwnError("no such thing")]
)
def test_bad_input_is_reported_in_one_sentence_and_code_2(
    error: ChefbotError, capsys: pytest.CaptureFixture[str]
) -> None:
    assert end_of(error) == 2
    assert capsys.readouterr().err == "chefbot: no such thing\n"


def test_ctrl_c_gives_the_code_of_the_signal(capsys: pytest.CaptureFixture[str]) -> None:
    assert end_of(KeyboardInterrupt()) == 130
    assert capsys.readouterr().err == "chefbot: interrupted\n"


def test_ctrl_c_in_the_call_of_a_kernel_is_not_a_fault(capsys: pytest.CaptureFixture[str]) -> None:
    in_kernel = SystemError("CPUDispatcher returned a result with an exception set")
    in_kernel.__cause__ = KeyboardInterrupt()
    assert end_of(in_kernel) == 130
    assert capsys.readouterr().err == "chefbot: interrupted\n"


@pytest.mark.parametrize("code", [0, 1, 3])
def test_the_exit_code_of_a_command_is_kept(code: int) -> None:
    assert end_of(SystemExit(code)) == code


def test_a_fault_of_the_program_is_not_hidden() -> None:
    with pytest.raises(ZeroDivisionError), user_errors_reported():
        raise ZeroDivisionError
    with pytest.raises(SystemError), user_errors_reported():
        raise SystemError
    with pytest.raises(FileNotFoundError), user_errors_reported():
        raise FileNotFoundError(errno.ENOENT, "no such file", "map.pgm")
    with pytest.raises(OSError, match="No space"), user_errors_reported():
        raise OSError(errno.ENOSPC, "No space left on device", "map.pgm")  # of a file, not of the output


@pytest.mark.parametrize("error", [None, BrokenPipeError(errno.EPIPE, "Broken pipe")])
def test_a_closed_pipe_at_the_output_is_not_a_fault(
    error: BaseException | None, capsys: pytest.CaptureFixture[str]
) -> None:
    with closed_pipe():
        assert end_of(error) == 0
    assert capsys.readouterr().err == ""


def test_bad_input_is_reported_also_into_a_closed_pipe(capsys: pytest.CaptureFixture[str]) -> None:
    with closed_pipe():
        assert end_of(UserError("no such thing")) == 2
    assert capsys.readouterr().err == "chefbot: no such thing\n"


def test_a_closed_pipe_does_not_change_the_exit_code() -> None:
    with closed_pipe():
        assert end_of(SystemExit(1)) == 1


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
def test_a_full_disk_at_the_output_is_reported_in_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with FULL.open("w") as file, redirect_stdout(file):
        file.write("a line")
        assert end_of(None) == 2
    assert (
        capsys.readouterr().err == "chefbot: standard output could not be written: No space left on device\n"
    )


def test_kernels_get_a_folder_only_where_none_is_writable(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(os, "access", lambda folder, _: folder == Path.home())
    choose_kernel_folder()
    assert "NUMBA_CACHE_DIR" not in os.environ and capsys.readouterr().err == ""
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/mine")
    choose_kernel_folder()
    assert os.environ["NUMBA_CACHE_DIR"] == "/mine"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    choose_kernel_folder()
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    assert folder.is_dir() and folder.parent == tmp_path
    assert str(folder) in capsys.readouterr().err
    monkeypatch.delenv("NUMBA_CACHE_DIR")
