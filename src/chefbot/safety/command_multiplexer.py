"""Command multiplexer: teleoperation before navigation, and no motion from a command that was held during a stop."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

RELEASE_TIMEOUT_NS = 300_000_000
"""Pause after which a command counts as a new one, ns."""


class CommandSource(Enum):
    """Sources of commands to the base."""

    TELEOP = "teleoperation"
    NAVIGATION = "navigation"


class StampedCommand(NamedTuple):
    """A commanded twist (m/s, rad/s) with its time of reception."""

    v: float
    w: float
    time_ns: int
    source: CommandSource | None = None
    """Who sent it; None for standstill without a command."""

    def age(self, now_ns: int) -> float:
        """Return the time since the reception, s."""
        return (now_ns - self.time_ns) / 1e9


class CommandMultiplexer:
    """Keeps the last command of each source and selects the one that counts.

    teleop_hold: time after the last teleop command before navigation is accepted, s. Times are in ns.
    """

    def __init__(self, teleop_hold: float) -> None:
        self.teleop_hold = teleop_hold
        self._commands: dict[CommandSource, StampedCommand] = {}
        self._refused_ns: dict[CommandSource, int] = {}
        self._lost_processes: set[str] = set()

    def accept(self, source: CommandSource, v: float, w: float, now_ns: int, *, stopped: bool) -> None:
        """Accept a twist (m/s, rad/s) of a source, unless it is held since the emergency stop.

        stopped: whether the emergency stop is active. After the release a moving command counts only once its source
        has paused for RELEASE_TIMEOUT_NS or has commanded standstill.
        """
        refused = self.refuses(source, now_ns)
        self._refused_ns.pop(source, None)
        if (v or w) and (stopped or refused):
            self._refused_ns[source] = now_ns
        else:
            self._commands[source] = StampedCommand(v, w, now_ns, source)

    def interrupt(self, source: CommandSource, now_ns: int) -> None:
        """Discard the command of a source; it counts again once the source has paused or commanded standstill."""
        command = self._commands.pop(source, None)
        if command is not None and (command.v or command.w):
            self._refused_ns[source] = now_ns

    def refuses(self, source: CommandSource, now_ns: int) -> bool:
        """Return whether a moving command of a source is refused, because it has been held since it was."""
        last_ns = self._refused_ns.get(source)
        return last_ns is not None and now_ns - last_ns <= RELEASE_TIMEOUT_NS

    def discard(self) -> None:
        """Discard the commands of all sources, so that none of them resumes."""
        self._commands.clear()

    def lose_process(self, name: str) -> None:
        """Discard all commands, and refuse navigation until the process is back; teleoperation still counts."""
        self._lost_processes.add(name)
        self.discard()

    def restore_process(self, name: str) -> None:
        """Accept navigation again once no process is missing."""
        self._lost_processes.discard(name)

    def select(self, now_ns: int) -> StampedCommand:
        """Return the command that counts, standstill without one; its age is not limited here."""
        teleop = self._commands.get(CommandSource.TELEOP)
        if teleop is not None and teleop.age(now_ns) <= self.teleop_hold:
            return teleop
        standstill = StampedCommand(0.0, 0.0, now_ns)
        if self._lost_processes:
            return standstill
        return self._commands.get(CommandSource.NAVIGATION, standstill)
