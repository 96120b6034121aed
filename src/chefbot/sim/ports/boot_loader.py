"""A motor board whose boot loader runs first after each reset, as that of an Arduino Mega does."""

from __future__ import annotations

from chefbot.sim.motor_board import SimulatedMotorBoard

BOOT_NS, EXTENDED_BOOT_NS = 800_000_000, 5_000_000_000
"""Time after a reset for which the boot loader waits for a program, and its time after the last byte that it has
received, ns (measured with the stock boot loader of the Mega in simavr)."""


class BoardWithBootLoader:
    """The board behind its USB converter: opening the port resets it, and bytes during the boot delay its start."""

    def __init__(self, board: SimulatedMotorBoard, now_ns: int) -> None:
        self._board, self._boot_ends_ns = board, now_ns
        self.resets = 0

    def reset(self, now_ns: int) -> None:
        """Reset the board: its motors stop, its counters are zero, and the boot loader runs."""
        self.resets += 1
        self._board.firmware.power_cycle()
        self._boot_ends_ns = now_ns + BOOT_NS

    def write(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the computer."""
        if not data:
            return
        if now_ns < self._boot_ends_ns:
            self._boot_ends_ns = max(self._boot_ends_ns, now_ns + EXTENDED_BOOT_NS)
        else:
            self._board.write(data)

    def read(self, now_ns: int) -> bytes:
        """Return what the board sends: nothing while the boot loader runs."""
        data = self._board.read()
        return b"" if now_ns < self._boot_ends_ns else data
