"""Room on the disk that is taken before it is needed: whether a file can still be finished is known beforehand."""

from __future__ import annotations

import ctypes
import errno
import os
import resource

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
        limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
        if limit != resource.RLIM_INFINITY and size > limit:
            return errno.EFBIG
        libc = ctypes.CDLL(None, use_errno=True)
        allocate = getattr(libc, "fallocate64", None) or getattr(libc, "fallocate", None)
        if allocate is None:  # as on a Mac
            return errno.ENOSYS
        begin, length = ctypes.c_int64(self._taken), ctypes.c_int64(size - self._taken)
        return 0 if allocate(self._handle, KEEP_SIZE, begin, length) == 0 else ctypes.get_errno()
