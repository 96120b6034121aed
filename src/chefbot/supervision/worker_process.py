"""Processes that load what takes longest before they are told who they are, as a spare does."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import threading
from collections.abc import Callable, Sequence

import msgspec

from chefbot.runtime.launch import Launch
from chefbot.supervision.state_handover import Word

MOST = 4096
"""Signs of life that are read at once: those of two minutes."""


class Preparation(msgspec.Struct, frozen=True):
    """The first line of a child's standard input: what it must load in any case."""

    kinds: tuple[str, ...]
    """Classes of nodes, as launch files name them."""
    folder: str
    """Where an owner's lie."""
    spare: bool = False
    """It has time: what the classes only load when they work is loaded too."""


class Order(msgspec.Struct, frozen=True):
    """The second line: who it is and what it does. It ends when its input does."""

    launch: Launch
    """The whole of it."""
    process: str
    folder: str
    """Where an owner's classes lie."""
    domain: int
    port: int
    last_words: tuple[Word, ...] = ()
    """Of its life before, if it had one."""

    @property
    def preparation(self) -> Preparation:
        """For this process, or any other of the launch."""
        kinds = dict.fromkeys(entry.kind for entry in self.launch.nodes.values() if entry.process)
        return Preparation(tuple(kinds), self.folder)


class Prepared:
    """A process that loads, then waits for its order. OSError if it cannot be started.

    In a session of its own: Ctrl-C is the launch's business. Its standard input is a socket, so that it can say by it
    that it lives.
    """

    def __init__(self, preparation: Preparation, command: Sequence[str]) -> None:
        self._line, theirs = socket.socketpair()
        try:
            self.process = subprocess.Popen(command, stdin=theirs.fileno(), start_new_session=True)
        except OSError:
            self._line.close()
            raise
        finally:
            theirs.close()
        self._write(msgspec.json.encode(preparation) + b"\n")

    def give(self, order: Order, ended: Callable[[], None]) -> None:
        """What it is from now on; `ended` is called, in a thread, when it is no more."""
        line = msgspec.json.encode(order) + b"\n"

        def attend() -> None:
            self._write(line)  # may be more than a socket holds, while it still loads
            self.process.wait()
            ended()

        threading.Thread(target=attend, name=f"attends {order.process}", daemon=True).start()

    def signs(self) -> bytes:
        """Of life, as `pulse` has them, since this was asked last; does not wait."""
        try:
            return self._line.recv(MOST, socket.MSG_DONTWAIT)
        except (BlockingIOError, ConnectionResetError):
            return b""  # nothing has come, or it has died: its exit code tells

    def ask_to_end(self) -> None:
        """By the end of its input; whoever writes to it is woken."""
        with contextlib.suppress(OSError):  # it has gone before
            self._line.shutdown(socket.SHUT_RDWR)
        self._line.close()

    def end(self, patience: float) -> None:
        """Kill it if it is still there after so many seconds."""
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.ask_to_end()

    def _write(self, line: bytes) -> None:
        with contextlib.suppress(OSError):  # it has died, or is told to end, before it has read all
            self._line.sendall(line)
