"""Waits for other threads and processes, independent of the speed of the machine."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
PATIENCE = 300.0
"""Seconds until a wait fails; it is not a requirement on the product, but longer than any machine needs."""
STEP = 0.01
QUIET = os.environ.get("CHEFBOT_QUIET_MACHINE") == "1"
"""Set by `make test-long`, when nothing else runs on the machine, so that limits of wall time are checked too."""


def in_time(took: float, limit: float) -> bool:
    """Return whether `took` is at most `limit`; on a machine with other load always true."""
    return took <= limit or not QUIET


LOADED_FACTOR = 10.0
"""Factor on limits of simulated time where other processes compete for the processors."""


def in_simulated_time(took: float, limit: float) -> bool:
    """Return whether `took`, robot's time, is at most `limit`, or LOADED_FACTOR times it on a loaded machine."""
    return took <= limit * (1.0 if QUIET else LOADED_FACTOR)


def wait_for(condition: Callable[[], T], what: str = "it", patience: float = PATIENCE) -> T:
    """Return the value of `condition` as soon as it is true; AssertionError after `patience` seconds."""
    limit = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < limit, f"waited {patience:g} s for {what}"
        time.sleep(STEP)
    return found
