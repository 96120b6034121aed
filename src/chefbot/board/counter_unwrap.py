"""Counters of so many bits, put together again to numbers that go on."""

from __future__ import annotations


def signed(value: int, bits: int = 32) -> int:
    """`value` modulo 2^bits in [-2^(bits-1), 2^(bits-1))."""
    half = 1 << (bits - 1)
    return (value + half) % (2 * half) - half


class Unwrapped:
    """A counter that never wraps, from readings that are less than 2^(bits-1) apart."""

    def __init__(self, bits: int = 32) -> None:
        self._bits = bits
        self.value: int | None = None
        """As first read, and on from there; None before."""

    def update(self, reading: int) -> int:
        """The value after a reading."""
        before = signed(reading, self._bits) if self.value is None else self.value
        self.value = before + signed(reading - before, self._bits)
        return self.value
