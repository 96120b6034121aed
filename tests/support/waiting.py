"""Waiting for what another thread or process does, however slow the machine is."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
PATIENCE = 300.0
"""Seconds after which something counts as not happening. No figure of the product: longer than any machine needs."""
STEP = 0.01
QUIET = os.environ.get("CHEFBOT_QUIET_MACHINE") == "1"
"""Set by `make test-long`: nothing else runs on the machine, so limits in seconds of its clock hold as well."""


def in_time(took: float, limit: float) -> bool:
    """Whether `took` is at most `limit`; where other work may have delayed it, any time is."""
    return took <= limit or not QUIET


def wait_for(condition: Callable[[], T], what: str = "it", patience: float = PATIENCE) -> T:
    """What `condition` returns as soon as it counts as true; AssertionError when nothing comes at all."""
    limit = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < limit, f"waited {patience:g} s for {what}"
        time.sleep(STEP)
    return found
