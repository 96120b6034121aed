"""Memory of large messages stays with the process."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

LARGE = 8 << 20
"""Bytes; what is larger, such as a map of a whole site, is rare and goes back at once."""
KEPT = 32 << 20
"""Bytes that may lie free at the end of a heap before they are given back."""
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # malloc.h of the GNU C library


@cache
def keep_memory() -> None:
    """Once in a process: picture after picture in the same memory.

    The GNU C library gives blocks above 128 kB back when they are freed, at first each, later depending on what was
    freed before; then every page of the next picture is a fault, which takes longer than sending it. Other C
    libraries have no such call and are left as they are.
    """
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, LARGE)
        mallopt(_TRIM_THRESHOLD, KEPT)
