"""Reservation of disk space before it is needed, so that a file can always be completed."""

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
"""FALLOC_FL_KEEP_SIZE of Linux's fallocate(2): reserved space does not change the file's reported size."""
STEP = 256 * 1024
"""Bytes reserved beyond the current need, to limit the number of system calls."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class DiskReservation:
    """The disk space that is reserved for one open file, counted from its beginning."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        self._reserved = 0
        self._supported = True

    def reserve(self, size: int) -> None:
        """Reserve space for a file of `size` bytes; OSError, without any change, if the disk is full.

        If the file system does not support reservation, or for a pipe, this does nothing, and writing itself
        fails.
        """
        if size <= self._reserved or not self._supported:
            return
        for requested in (size + STEP, size):
            code = self._allocate(requested)
            if code not in FULL:
                self._supported, self._reserved = code == 0, requested
                return
        raise OSError(code, os.strerror(code))

    def release(self) -> None:
        """Release the space that was reserved but not used."""
        if self._supported and self._reserved:
            os.ftruncate(self._handle, os.fstat(self._handle).st_size)

    def _allocate(self, size: int) -> int:
        """Reserve `size` bytes; return 0 or the error number."""
        if size > _max_file_size():
            return errno.EFBIG
        if sys.platform != "linux":
            return self._probe(size)
        libc = ctypes.CDLL(None, use_errno=True)
        allocate = getattr(libc, "fallocate64", None) or getattr(libc, "fallocate", None)
        if allocate is None:  # the C library has no fallocate
            return self._probe(size)
        begin, length = ctypes.c_int64(self._reserved), ctypes.c_int64(size - self._reserved)
        return 0 if allocate(self._handle, KEEP_SIZE, begin, length) == 0 else ctypes.get_errno()

    def _probe(self, size: int) -> int:
        """Test for `size` bytes where the system cannot reserve: write zeros and truncate them again.

        A full disk is thus detected before a record is begun, but another program may still use the space
        before it is written.
        """
        try:
            if not stat.S_ISREG(os.fstat(self._handle).st_mode):
                return errno.ESPIPE
            end = os.lseek(self._handle, 0, os.SEEK_CUR)
            written = os.fstat(self._handle).st_size
        except OSError as error:
            return error.errno or errno.EIO
        try:
            _write_zeros(self._handle, written, size)
        except OSError as error:
            return error.errno or errno.EIO
        finally:
            os.ftruncate(self._handle, written)
            os.lseek(self._handle, end, os.SEEK_SET)
        return 0


def _max_file_size() -> float:
    """Return the maximum file size of this process, bytes."""
    if resource is None:
        return math.inf
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return math.inf if limit == resource.RLIM_INFINITY else limit


def _write_zeros(handle: int, begin: int, end: int) -> None:
    """Write zeros; file systems allocate space in the write call, not when data goes to disk.

    OSError if there is no space.
    """
    os.lseek(handle, begin, os.SEEK_SET)
    while begin < end:
        begin += os.write(handle, bytes(min(STEP, end - begin)))
