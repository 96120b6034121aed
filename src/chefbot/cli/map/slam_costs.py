"""Time and memory of SLAM, scan by scan."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from chefbot.runtime.clock import wall_ns

MEMORY_PERIOD = 20
"""Number of scans between two readings of the memory."""
_STATM = Path("/proc/self/statm")


@dataclass
class SlamCosts:
    """Collects what each scan cost; the first `add` must follow the construction at once."""

    seconds: list[float] = field(default_factory=list)
    """Wall time of each scan, s."""
    memory: list[tuple[int, float]] = field(default_factory=list)
    """Number of scans done and resident memory in MB; empty on systems without /proc."""
    finish_seconds: float = 0.0
    """Wall time after the last scan, for the last closures, the joint adjustment and the map, s."""
    _last_ns: int = field(default_factory=wall_ns)

    def add(self) -> None:
        """Note the end of one scan."""
        now = wall_ns()
        self.seconds.append((now - self._last_ns) / 1e9)
        if len(self.seconds) % MEMORY_PERIOD == 1:
            self._read_memory()
        self._last_ns = wall_ns()

    def end(self) -> None:
        """Note the end of the run."""
        self.finish_seconds = (wall_ns() - self._last_ns) / 1e9
        self._read_memory()

    def _read_memory(self) -> None:
        """Note the resident memory."""
        if _STATM.exists():
            pages = int(_STATM.read_text().split()[1])
            self.memory.append((len(self.seconds), pages * os.sysconf("SC_PAGESIZE") / 1e6))
