"""Zenoh's threads as Python sees them."""

from __future__ import annotations

import ctypes
from threading import get_native_id

_known: set[int] = set()
"""The system's numbers: Python's own are addresses, which come again."""


def keep_state() -> None:
    """The calling thread of Zenoh's keeps its Python thread state for good; called at the begin of a callback.

    A thread that Python did not start gets a new state, with a stack of 16 kB from the operating system, whenever
    it calls into Python, and gives it back behind the call. Where one such call never ends it stays (C API,
    "Non-Python created threads"): a message then costs a fifth less. Zenoh changes its receiving thread hardly ever
    (once at the start, then not while 60 processes came and went), so few states are left behind by threads that end.
    """
    thread = get_native_id()
    if thread not in _known:
        _known.add(thread)
        ctypes.pythonapi.PyGILState_Ensure()
