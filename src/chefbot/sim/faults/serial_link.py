"""Faults of the serial link between computer and motor board: no bytes, or flipped bits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator


def flip_bits(data: bytes, rate: float, rng: Generator) -> bytes:
    """Return the data with each bit flipped with the probability `rate`."""
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    return np.packbits(bits ^ (rng.random(bits.size) < rate)).tobytes()


class FaultySerialLink:
    """Both directions of a serial link, of which `send` and `receive` are the board's end."""

    def __init__(self, send: Callable[[bytes], int], receive: Callable[[], bytes], rng: Generator) -> None:
        self._send, self._receive, self._rng = send, receive, rng
        self.unplugged = False
        self.bit_errors = 0.0
        """Probability that a bit flips."""

    def write(self, data: bytes) -> int:
        """Write bytes from the computer; return how many the sender's end has accepted."""
        if self.unplugged:
            return len(data)
        return self._send(flip_bits(data, self.bit_errors, self._rng) if self.bit_errors else data)

    def read(self) -> bytes:
        """Return all bytes that arrive from the board; those of an unplugged board are lost."""
        data = self._receive()
        if self.unplugged:
            return b""
        return flip_bits(data, self.bit_errors, self._rng) if self.bit_errors else data
