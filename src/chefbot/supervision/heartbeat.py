"""Heartbeats of a launch's worker processes, which detect a process that hangs without having died.

A thread of each worker sends one byte to the launch process every BEAT seconds, on the socket by which it got
its specification: either the event loop has progressed since the last heartbeat, or it is still busy with the
same step. So a process that computes for a long time can be distinguished from one that is stopped, and the launch
need not poll.
"""

from __future__ import annotations

import os
import socket
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from chefbot.runtime.loop import Loop

HEARTBEAT_PERIOD = 0.03
"""Heartbeat period, s."""
PROGRESSING, BUSY = b".", b"-"
"""Heartbeat bytes: the loop is idle or has begun a new step since the last heartbeat; it is busy with the
same step."""
MAX_SILENCE = 0.12
"""Maximum time without a heartbeat before a process counts as unresponsive, s: four heartbeats are
missing. Nodes may allow their process more (`Node.max_silence`)."""
MAX_STEP_TIME = 2.0
"""Maximum time at one step before a process counts as unresponsive, s: its pose or plan is as old."""
HEARTBEAT_TIMEOUT = 2.0
"""Time without a heartbeat after which a process is killed, s: nine times the longest silence that was
measured on a machine with five times too much to do (docs/why.md). Waiting for a disk, or for a library that
holds the interpreter lock, can take longer."""
STEP_TIMEOUT = 30.0
"""Time at one step after which a process is killed, s: compiling a user's kernel on a small computer takes a
part of that."""
STARTUP_TIMEOUT = 60.0
"""Maximum time until the first heartbeat, s: the process loads, and waits for the robot's time."""


class HeartbeatSender:
    """Sends heartbeats of `loop` from a thread of its own until the other end is closed.

    `descriptor` is that of a connected socket.
    """

    def __init__(self, loop: Loop, descriptor: int) -> None:
        self._loop = loop
        self._socket = socket.socket(fileno=os.dup(descriptor))
        threading.Thread(target=self._send_heartbeats, name="heart", daemon=True).start()

    def _send_heartbeats(self) -> None:
        timer, last_step = threading.Event(), 0
        while not timer.wait(HEARTBEAT_PERIOD):
            step = self._loop.callback_start_ns
            try:
                self._socket.send(BUSY if step and step == last_step else PROGRESSING, socket.MSG_DONTWAIT)
            except BlockingIOError:
                pass  # the launch process is stopped and does not read: drop the heartbeat
            except OSError:
                return  # the launch process has exited
            last_step = step


class HeartbeatMonitor:
    """Monitors the heartbeats of one process.

    max_silence: time without a heartbeat, s, before the process counts as unresponsive.
    """

    def __init__(self, max_silence: float = MAX_SILENCE) -> None:
        self._max_silence = max_silence
        self._silence = self._busy_time = 0.0
        self._started = False

    def update(self, heartbeats: bytes, elapsed: float) -> None:
        """Process the `heartbeats` that were received in the last `elapsed` seconds.

        The caller bounds `elapsed`: after a late call, heartbeats of the time between may not have arrived
        yet.
        """
        self._started |= bool(heartbeats)
        self._silence = 0.0 if heartbeats else self._silence + elapsed
        self._busy_time = 0.0 if PROGRESSING in heartbeats else self._busy_time + elapsed

    @property
    def is_unresponsive(self) -> bool:
        """Whether nothing that moves should rely on this process now."""
        return self._started and (self._silence > self._max_silence or self._busy_time > MAX_STEP_TIME)

    @property
    def kill_reason(self) -> str:
        """The reason why the process must be killed, or an empty string."""
        if not self._started:
            late = self._silence > STARTUP_TIMEOUT
            return f"no heartbeat within {STARTUP_TIMEOUT:.0f} s of its start" if late else ""
        if self._silence > HEARTBEAT_TIMEOUT:
            return f"no heartbeat for {HEARTBEAT_TIMEOUT:.1f} s"
        return f"busy with one step for {STEP_TIMEOUT:.0f} s" if self._busy_time > STEP_TIMEOUT else ""
