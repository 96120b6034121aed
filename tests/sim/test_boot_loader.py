"""Tests the board that a boot loader keeps from the computer for a while after each reset."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.sim.ports.boot_loader import BOOT_NS, EXTENDED_BOOT_NS, BoardWithBootLoader

SECOND = 1_000_000_000


class Board:
    """A board that notes what it gets and sends `state` each time."""

    def __init__(self) -> None:
        self.got: list[bytes] = []
        self.cycles = 0
        self.firmware: Any = SimpleNamespace(power_cycle=self._cycle)

    def _cycle(self) -> None:
        self.cycles += 1

    def write(self, data: bytes) -> int:
        self.got.append(data)
        return len(data)

    def read(self) -> bytes:
        return b"state"


def plugged(now_ns: int = 0) -> tuple[BoardWithBootLoader, Board]:
    board: Any = Board()
    return BoardWithBootLoader(board, now_ns), board


def test_a_board_that_is_running_answers_at_once() -> None:
    port, board = plugged(5 * SECOND)
    port.write(b"hello", 5 * SECOND)
    assert board.got == [b"hello"] and port.read(5 * SECOND) == b"state"
    assert port.resets == board.cycles == 0


def test_after_a_reset_it_is_silent_until_it_has_started() -> None:
    port, board = plugged()
    port.reset(SECOND)
    assert port.resets == board.cycles == 1
    assert port.read(SECOND) == port.read(SECOND + BOOT_NS - 1) == b""
    assert port.read(SECOND + BOOT_NS) == b"state"
    assert board.got == []


@pytest.mark.parametrize("at", [0, BOOT_NS // 2, BOOT_NS - 1])
def test_bytes_during_the_boot_are_lost_and_delay_it(at: int) -> None:
    port, board = plugged()
    port.reset(0)
    port.write(b"hello", at)
    port.write(b"", at + EXTENDED_BOOT_NS - 2)
    assert port.read(at + EXTENDED_BOOT_NS - 1) == b""
    assert port.read(at + EXTENDED_BOOT_NS) == b"state"
    port.write(b"again", at + EXTENDED_BOOT_NS)
    assert board.got == [b"again"]


@settings(max_examples=50)
@given(st.lists(st.tuples(st.integers(0, 20 * SECOND), st.sampled_from(["write", "reset"])), max_size=20))
def test_a_board_starts_once_nobody_has_disturbed_it(events: list[tuple[int, str]]) -> None:
    port, board = plugged()
    ends, received = 0, 0
    for now, what in sorted(events):
        if what == "reset":
            port.reset(now)
            ends = now + BOOT_NS
        else:
            port.write(b"x", now)
            received += now >= ends
            ends = max(ends, now + EXTENDED_BOOT_NS) if now < ends else ends
        assert port.read(now) == (b"state" if now >= ends else b"")
    assert len(board.got) == received
    assert port.read(40 * SECOND) == b"state"
