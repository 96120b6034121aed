"""Start and end of a command: a folder for compiled kernels; errors as one sentence and an exit code."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import chefbot
from chefbot.errors import ChefbotError
from chefbot.signals import INTERRUPTED

DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of a disk that standard output may be redirected to."""


def choose_kernel_folder() -> None:
    """Set a temporary folder for compiled kernels where no usual one is writable: Numba does not start without."""
    usual = (Path(chefbot.__file__).parent, Path.home() / ".cache", Path.home())
    if "NUMBA_CACHE_DIR" not in os.environ and not any(os.access(folder, os.W_OK) for folder in usual):
        folder = tempfile.mkdtemp(prefix="chefbot_kernels_")
        os.environ["NUMBA_CACHE_DIR"] = folder
        _report(f"no folder for compiled kernels is writable; they are stored in {folder}")


def _report(sentence: str) -> None:
    sys.stderr.write(f"chefbot: {printable(sentence)}\n")


def printable(text: str) -> str:
    """Return the text with escapes for what would control the terminal: names of files may contain anything."""
    return "".join(letter if letter.isprintable() or letter == "\n" else _escape(letter) for letter in text)


def _escape(letter: str) -> str:
    return letter.encode("unicode_escape", "backslashreplace").decode("ascii")


@contextmanager
def user_errors_reported() -> Iterator[None]:
    """Report bad input in one sentence with exit code 2; Ctrl-C gives 130, a closed pipe at the output 0."""
    try:
        with _flushed(), _bad_input_reported():
            yield
    except (KeyboardInterrupt, SystemError) as error:
        # Ctrl-C in the call of a kernel is a SystemError with the interrupt as its cause
        if isinstance(error, SystemError) and not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        _report("interrupted")
        raise SystemExit(INTERRUPTED) from None
    except BrokenPipeError as error:
        _redirect_stdout_to_null()
        ended = error.__context__  # the command's own end, if only the flush after it has failed
        raise SystemExit(ended.code if isinstance(ended, SystemExit) else 0) from None
    except OSError as error:
        if error.errno in (errno.ENAMETOOLONG, errno.ELOOP):
            _report(f"{str(error.filename)[:200]} cannot be read or written: {error.strerror}")
            raise SystemExit(2) from None
        if error.errno not in DISK_ERRORS or error.filename is not None:
            raise
        _redirect_stdout_to_null()
        _report(f"standard output could not be written: {error.strerror}")
        raise SystemExit(2) from None


@contextmanager
def _bad_input_reported() -> Iterator[None]:
    try:
        yield
    except ChefbotError as error:
        _report(f"{error}")
        raise SystemExit(2) from None


@contextmanager
def _flushed() -> Iterator[None]:
    """Flush standard output here: an error at Python's exit could no longer be reported."""
    try:
        yield
    finally:
        sys.stdout.flush()


def _redirect_stdout_to_null() -> None:
    """Discard what is buffered, since Python would write it at exit and fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
