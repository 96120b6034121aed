"""Worker processes that preload slow modules before they are assigned a part of the launch."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import threading
from collections.abc import Callable, Sequence

import msgspec

from chefbot.runtime.launch import Launch, node_class
from chefbot.supervision.heartbeat import MAX_SILENCE
from chefbot.supervision.state_handover import StoredMessage

EXIT_TIMEOUT = 1.5
"""Time that a worker gives its nodes to stop, from the request to exit to its forced exit, s."""
KILL_TIMEOUT = EXIT_TIMEOUT + 0.5
"""Time from the request to exit until the supervisor kills a worker, s."""
MAX_HEARTBEATS = 4096
"""Maximum number of heartbeats that are read at once: those of two minutes."""


class PreloadSpec(msgspec.Struct, frozen=True):
    """What a worker process must preload whatever it is assigned; the first line of its standard input."""

    kinds: tuple[str, ...]
    """Node classes, as launch files name them."""
    folder: str
    """Folder of the user's own node classes."""
    spare: bool = False
    """Whether it is a spare, which has time to load also what the classes otherwise load on first use."""


class WorkerSpec(msgspec.Struct, frozen=True):
    """What a worker process is and runs; the second line of its standard input.

    The process exits at the end of its input.
    """

    launch: Launch
    """The complete launch."""
    process: str
    folder: str
    """Folder of the user's own node classes."""
    domain: int
    port: int
    restored_messages: tuple[StoredMessage, ...] = ()
    """Messages that restore its state after a restart."""

    @property
    def max_silence(self) -> float:
        """Time without a heartbeat before the process counts as unresponsive, s."""
        entries = [entry for entry in self.launch.nodes.values() if entry.process == self.process]
        allowed = [node_class(entry.kind, "supervisor").max_silence for entry in entries]
        return max(MAX_SILENCE, min(allowed, default=0.0))

    @property
    def preload_spec(self) -> PreloadSpec:
        """What any worker process of this launch must preload."""
        kinds = dict.fromkeys(entry.kind for entry in self.launch.nodes.values() if entry.process)
        return PreloadSpec(tuple(kinds), self.folder)


class WorkerProcess:
    """A process that preloads modules, then waits for its order; OSError if it cannot be started.

    It runs in a session of its own, so that Ctrl-C is handled by the launch process. Its standard input is a
    socket, so that it can send heartbeats over it.
    """

    def __init__(self, preparation: PreloadSpec, command: Sequence[str]) -> None:
        self._socket, child_socket = socket.socketpair()
        try:
            self.process = subprocess.Popen(command, stdin=child_socket.fileno(), start_new_session=True)
        except OSError:
            self._socket.close()
            raise
        finally:
            child_socket.close()
        self._send(msgspec.json.encode(preparation) + b"\n")

    def assign(self, order: WorkerSpec, on_exit: Callable[[], None]) -> None:
        """Assign the order; `on_exit` is called in a thread when the process has exited."""
        line = msgspec.json.encode(order) + b"\n"

        def watch() -> None:
            self._send(line)  # blocks if it exceeds the socket's buffer while the process still loads
            self.process.wait()
            on_exit()

        threading.Thread(target=watch, name=f"attends {order.process}", daemon=True).start()

    def heartbeats(self) -> bytes:
        """Return the heartbeat bytes received since the last call, without blocking."""
        try:
            return self._socket.recv(MAX_HEARTBEATS, socket.MSG_DONTWAIT)
        except (BlockingIOError, ConnectionResetError):
            return b""  # no heartbeat yet, or the process has died: see its exit code

    def request_exit(self) -> None:
        """Request the process to exit by closing its input; a blocked writer is woken."""
        with contextlib.suppress(OSError):  # it has exited already
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def end(self, timeout: float) -> None:
        """Wait for the process to exit, and kill it after `timeout` seconds."""
        try:
            self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.request_exit()

    def _send(self, line: bytes) -> None:
        with contextlib.suppress(OSError):  # it has died or is being ended before it has read everything
            self._socket.sendall(line)
