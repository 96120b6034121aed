"""How a verb begins and ends: a folder for kernels; faults as one sentence on stderr, and the exit code."""

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

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Faults of a disk that `chefbot urdf > FILE` may meet."""


def find_a_place_for_kernels() -> None:
    """Numba does not start without a folder for compiled kernels; where none can be written, a passing one does."""
    usual = (Path(chefbot.__file__).parent, Path.home() / ".cache", Path.home())
    if "NUMBA_CACHE_DIR" not in os.environ and not any(os.access(folder, os.W_OK) for folder in usual):
        folder = tempfile.mkdtemp(prefix="chefbot_kernels_")
        os.environ["NUMBA_CACHE_DIR"] = folder
        _tell(f"no folder for compiled kernels can be written; they go to {folder}")


def _tell(sentence: str) -> None:
    sys.stderr.write(f"chefbot: {sentence}\n")


@contextmanager
def ended() -> Iterator[None]:
    """Bad input is told with exit code 2, Ctrl-C is 130, a reader of the output that went away is fine."""
    try:
        with _flushed():
            yield
    except ChefbotError as error:
        _tell(f"{error}")
        raise SystemExit(2) from None
    except KeyboardInterrupt:
        raise SystemExit(130) from None
    except BrokenPipeError:
        _leave_stdout()
        raise SystemExit(0) from None
    except OSError as error:
        if error.errno not in NO_ROOM or error.filename is not None:
            raise
        _leave_stdout()
        _tell(f"what it had to print could not be written: {error.strerror}")
        raise SystemExit(2) from None


@contextmanager
def _flushed() -> Iterator[None]:
    """When Python ends, a full disk could no longer be told."""
    try:
        yield
    finally:
        sys.stdout.flush()


def _leave_stdout() -> None:
    """Python writes what is left when it ends, and would complain again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
