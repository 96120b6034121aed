"""Wraparound of counters with a fixed number of bits."""

from __future__ import annotations


def wrap_signed(value: int, bits: int = 32) -> int:
    """Return `value` modulo 2^bits as a signed number in [-2^(bits-1), 2^(bits-1))."""
    half = 1 << (bits - 1)
    return (value + half) % (2 * half) - half


class CounterUnwrapper:
    """Extends a wrapping 32-bit counter to one without wraparound; readings must be less than 2^31 apart."""

    def __init__(self) -> None:
        self.value: int | None = None
        """The extended count, which starts at the first reading; None before it."""

    def update(self, reading: int) -> int:
        """Process a reading and return the extended count."""
        previous = wrap_signed(reading) if self.value is None else self.value
        # The signed difference modulo 2^bits is the motion since the last reading.
        self.value = previous + wrap_signed(reading - previous)
        return self.value
