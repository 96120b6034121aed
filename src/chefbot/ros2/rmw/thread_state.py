"""Python thread states of Zenoh's threads."""

from __future__ import annotations

import ctypes
from threading import get_native_id

_known: set[int] = set()
"""Native thread ids; Python's own ids are addresses, which are reused."""


def keep_thread_state() -> None:
    """Keep the Python thread state of the calling Zenoh thread; call at the start of a callback.

    A thread that Python did not start gets a new state, with a 16 kB stack from the operating system,
    whenever it calls into Python, and releases it after the call. If one such call never ends the state stays
    (C API, "Non-Python created threads"), and a message then costs a fifth less. Zenoh hardly ever changes
    its receiving thread (once at the start, then not while 60 processes came and went), so few states leak
    with threads that end.
    """
    thread = get_native_id()
    if thread not in _known:
        _known.add(thread)
        ctypes.pythonapi.PyGILState_Ensure()
