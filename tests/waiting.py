"""Waiting for what another thread or process does, however slow the machine is."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
PATIENCE = 60.0
"""Seconds."""
STEP = 0.01


def wait_for(condition: Callable[[], T], what: str = "it", patience: float = PATIENCE) -> T:
    """What `condition` returns as soon as it counts as true; AssertionError when nothing comes at all."""
    limit = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < limit, f"waited {patience:g} s for {what}"
        time.sleep(STEP)
    return found
