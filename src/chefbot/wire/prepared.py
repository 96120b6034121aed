"""Processes that load what takes longest before they are told who they are, as a spare does."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Callable, Sequence

import msgspec

from chefbot.runtime.launch import Launch
from chefbot.wire.last_words import Word


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

    In a session of its own: Ctrl-C is the launch's business. Its input has no buffer here, so that closing it never
    waits for one that does not read.
    """

    def __init__(self, preparation: Preparation, command: Sequence[str]) -> None:
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, bufsize=0, start_new_session=True)
        self._write(msgspec.json.encode(preparation) + b"\n")

    def give(self, order: Order, ended: Callable[[], None]) -> None:
        """What it is from now on; `ended` is called, in a thread, when it is no more."""
        line = msgspec.json.encode(order) + b"\n"

        def attend() -> None:
            self._write(line)  # may be more than a pipe holds, while it still loads
            self.process.wait()
            ended()

        threading.Thread(target=attend, name=f"attends {order.process}", daemon=True).start()

    def ask_to_end(self) -> None:
        """By the end of its input."""
        assert self.process.stdin is not None
        self.process.stdin.close()

    def end(self, patience: float) -> None:
        """Kill it if it is still there after so many seconds."""
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.ask_to_end()

    def _write(self, line: bytes) -> None:
        assert self.process.stdin is not None
        rest = memoryview(line)
        try:
            while rest:
                rest = rest[self.process.stdin.write(rest) :]
        except (OSError, ValueError):
            return  # it has died, or is told to end, before it has read all: its exit code tells the rest
