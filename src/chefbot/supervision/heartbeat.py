"""Signs of life of a launch's other processes: one that has stopped without having died is found by its silence.

A thread of each process writes a letter to its launch every BEAT, on the line that its orders came by: whether its
loop turns, or is still at the step that it was at before. So one that thinks for long is told from one that is
stopped, and nothing has to be answered.
"""

from __future__ import annotations

import os
import socket
import threading

from chefbot.runtime.loop import Loop

BEAT = 0.03
"""Seconds between two signs."""
TURNS, THINKS = b".", b"-"
"""The loop waits or has begun a new step since the last sign; it is at the same step still."""
SILENT = 0.12
"""Seconds without a sign after which the robot must not rely on a process: four are missing."""
LONG = 2.0
"""Seconds after which it must not rely on one that is at one step all the time: a pose or a plan is as old."""
HANGS = 2.0
"""Seconds without a sign after which it is ended: nine times the longest silence that was measured on a machine with
five times too much to do (docs/why.md). Waiting for a disk, or a library that keeps the interpreter, takes longer."""
ENDLESS = 30.0
"""Seconds after which a step has no end: compiling an owner's kernel on a small computer takes a part of that."""
BEGINNING = 60.0
"""Seconds that it has until its first sign: it loads, and waits for the robot's time."""


class Heart:
    """Beats on `line`, the descriptor of a socket, until the other end is closed; `loop` is what is alive."""

    def __init__(self, loop: Loop, line: int) -> None:
        self._loop = loop
        self._line = socket.socket(fileno=os.dup(line))
        threading.Thread(target=self._beat, name="heart", daemon=True).start()

    def _beat(self) -> None:
        pause, before = threading.Event(), 0
        while not pause.wait(BEAT):
            step = self._loop.step_began_ns
            try:
                self._line.send(THINKS if step and step == before else TURNS, socket.MSG_DONTWAIT)
            except BlockingIOError:
                pass  # the launch itself has stopped, and nobody reads
            except OSError:
                return  # the launch is no more
            before = step


class Pulse:
    """What the signs of one process say; felt again and again."""

    def __init__(self) -> None:
        self._silent = self._thinks = 0.0
        self._begun = False

    def feel(self, signs: bytes, elapsed: float) -> None:
        """`signs` that came in the `elapsed` seconds since it was felt last.

        Who feels it late counts little: what came meanwhile may not be here yet.
        """
        self._begun |= bool(signs)
        self._silent = 0.0 if signs else self._silent + elapsed
        self._thinks = 0.0 if TURNS in signs else self._thinks + elapsed

    @property
    def is_weak(self) -> bool:
        """Nothing that moves should rely on it now."""
        return self._begun and (self._silent > SILENT or self._thinks > LONG)

    @property
    def verdict(self) -> str:
        """Why it must be ended; empty if it need not."""
        if not self._begun:
            return f"it has not begun after {BEGINNING:.0f} s" if self._silent > BEGINNING else ""
        if self._silent > HANGS:
            return f"no sign of life for {HANGS:.1f} s"
        return f"at one step for {ENDLESS:.0f} s" if self._thinks > ENDLESS else ""
