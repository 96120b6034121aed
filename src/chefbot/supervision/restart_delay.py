"""Delays before a process that died is started again."""

from __future__ import annotations

MIN_RESTART_DELAY, MAX_RESTART_DELAY = 0.5, 10.0
"""Delay before a process that died is restarted, s; doubled at each restart up to the maximum."""
STABLE_TIME = 10.0
"""Uptime after which the restart delay is reset to its minimum, s."""
