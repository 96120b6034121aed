"""Room on the disk that is taken before it is needed: whether a file can still be finished is known beforehand."""

from __future__ import annotations

import ctypes
import errno
import math
import os
import stat
import sys

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

KEEP_SIZE = 1
"""FALLOC_FL_KEEP_SIZE of Linux's fallocate(2): the file does not look longer than what was written to it."""
STEP = 256 * 1024
"""Bytes that are asked for beyond what is needed now, so that the system is not asked too often."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class Room:
    """Of one open file, from its beginning."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._taken = 0
        self._can_tell = True

    def take(self, size: int) -> None:
        """The file may grow to so many bytes from now on. OSError, with nothing changed, where the disk is full.

        A file system that cannot promise it, or a pipe, lets everything pass: there the writing itself must tell.
        """
        if size <= self._taken or not self._can_tell:
            return
        for wanted in (size + STEP, size):
            code = self._ask(wanted)
            if code not in FULL:
                self._can_tell, self._taken = code == 0, wanted
                return
        raise OSError(code, os.strerror(code))

    def give_back(self) -> None:
        """What was not used."""
        if self._can_tell and self._taken:
            os.ftruncate(self._handle, os.fstat(self._handle).st_size)

    def _ask(self, size: int) -> int:
        """0, or the error number."""
        if size > _longest():
            return errno.EFBIG
        if sys.platform != "linux":
            return self._try_on(size)
        libc = ctypes.CDLL(None, use_errno=True)
        allocate = getattr(libc, "fallocate64", None) or getattr(libc, "fallocate", None)
        if allocate is None:  # a C library without it
            return self._try_on(size)
        begin, length = ctypes.c_int64(self._taken), ctypes.c_int64(size - self._taken)
        return 0 if allocate(self._handle, KEEP_SIZE, begin, length) == 0 else ctypes.get_errno()

    def _try_on(self, size: int) -> int:
        """Where nothing can be promised: zeros are written up to `size`, and cut off again.

        It tells a full disk before a record is begun; another program may still take the room in between, as it
        may not where the system promises it.
        """
        try:
            if not stat.S_ISREG(os.fstat(self._handle).st_mode):
                return errno.ESPIPE
            end = os.lseek(self._handle, 0, os.SEEK_CUR)
            written = os.fstat(self._handle).st_size
        except OSError as error:
            return error.errno or errno.EIO
        try:
            _fill(self._handle, written, size)
        except OSError as error:
            return error.errno or errno.EIO
        finally:
            os.ftruncate(self._handle, written)
            os.lseek(self._handle, end, os.SEEK_SET)
        return 0


def _longest() -> float:
    """Bytes that a file of this process may have."""
    if resource is None:
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return math.inf if limit == resource.RLIM_INFINITY else limit


def _fill(handle: int, begin: int, end: int) -> None:
    """Zeros; a file system looks for room when it takes them, not when they go to the disk. OSError without room."""
    os.lseek(handle, begin, os.SEEK_SET)
    while begin < end:
        begin += os.write(handle, bytes(min(STEP, end - begin)))
