"""Simulates network faults between browser and web UI by a TCP proxy."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time

RESET = struct.pack("ii", 1, 0)
"""SO_LINGER with which closing sends a reset, as a machine without the connection's state does."""


class FaultyNetwork:
    """A TCP proxy to a local port.

    mode: "pass", "late" (by `delay` seconds), "slow", "hole" (all data are lost), "answers lost" or "refused".
    rate: of a slow link, bytes/s. accepted: number of connections that browsers have opened, refused ones included.
    received: number of bytes that browsers have received.
    """

    def __init__(self, port: int) -> None:
        self.mode, self.delay, self.rate = "pass", 0.0, 20_000.0
        self.accepted = self.received = 0
        self.target = port
        self._pairs: list[tuple[socket.socket, socket.socket]] = []
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def reset(self) -> None:
        """Reset all connections."""
        pairs, self._pairs = self._pairs, []
        for end in (end for pair in pairs for end in pair):
            with contextlib.suppress(OSError):
                end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def close(self) -> None:
        self._listener.close()
        self.reset()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                browser = self._listener.accept()[0]
                if self.mode == "refused":
                    browser.close()
                    self.accepted += 1
                    continue
                server = socket.create_connection(("127.0.0.1", self.target))
                self._pairs.append((browser, server))
                self.accepted += 1
                for ends in ((browser, server, "hole"), (server, browser, "answers lost")):
                    threading.Thread(target=self._pump, args=ends, daemon=True).start()

    def _pump(self, source: socket.socket, sink: socket.socket, losing: str) -> None:
        """Forward data; after the first loss the connection stays dead, as its byte stream has a gap."""
        lost = False
        with contextlib.suppress(OSError):
            while data := source.recv(1024 if self.mode == "slow" else 65536):
                if self.mode == "late":
                    time.sleep(self.delay)
                elif self.mode == "slow":
                    time.sleep(len(data) / self.rate)
                lost = lost or self.mode in ("hole", losing)
                if not lost:
                    sink.sendall(data)
                    self.received += len(data) if losing == "answers lost" else 0
            sink.shutdown(socket.SHUT_WR)
