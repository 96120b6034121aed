"""Tuning of glibc's malloc so that the memory of large messages stays with the process."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

MMAP_THRESHOLD = 8 << 20
"""Size in bytes above which a block is returned to the system at once, such as the map of a whole site."""
TRIM_THRESHOLD = 32 << 20
"""Free bytes at the end of the heap that are kept before they are returned to the system."""
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # malloc.h of the GNU C library


@cache
def tune_malloc() -> None:
    """Keep freed memory in the process so that successive images reuse it.

    The GNU C library returns blocks above 128 kB to the system when they are freed: at first every block,
    later depending on what was freed before. Every page of the next image is then a page fault, which takes
    longer than sending the image. Other C libraries have no such call and are left unchanged. Only the first
    call has an effect.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, MMAP_THRESHOLD)
        mallopt(_TRIM_THRESHOLD, TRIM_THRESHOLD)
