"""Clock synchronization and the sequence filter, on simulated delays."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.board.messages import BatteryLine
from chefbot.board.sequence_filter import SequenceFilter
from chefbot.maths.clock_sync import ClockSync

MS = 1_000_000
BITS = 1 << 32
DELAYS = st.lists(st.integers(0, 50 * MS), min_size=2, max_size=60)


@given(DELAYS, st.integers(0, BITS - 1), st.integers(0, 10**15))
def test_stamps_are_monotonic_and_never_after_the_reception(
    delays: list[int], start: int, offset: int
) -> None:
    sync, last = ClockSync(start, offset + start * 1000 + delays[0]), 0
    for n, delay in enumerate(delays):
        board_us = start + n * 20_000
        received = offset + board_us * 1000 + delay
        full = sync.unwrap(board_us % BITS, received)
        assert (full - board_us) % BITS == 0
        stamp = sync.stamp(full, received)
        assert last <= stamp
        last = stamp


@given(st.integers(0, BITS - 1), st.integers(1, 200))
def test_the_counter_is_unwrapped_over_its_wrap(start: int, steps: int) -> None:
    sync = ClockSync(start, 0)
    for n in range(steps):
        assert sync.unwrap((start + n * 10_000_000) % BITS, n * 10_000 * MS) == start + n * 10_000_000


@given(DELAYS)
def test_without_drift_stamps_are_off_by_the_minimum_delay(delays: list[int]) -> None:
    sync = ClockSync(0, delays[0])
    for n, delay in enumerate(delays, 1):
        received = n * 20_000 * 1000 + delay
        stamp = sync.stamp(n * 20_000, received)
    n = len(delays)
    shortest = min(delays)
    for k in range(n + 1, n + 400):
        stamp = sync.stamp(k * 20_000, k * 20_000 * 1000 + shortest)
    assert abs(stamp - (n + 399) * 20_000 * 1000 - shortest) <= 1


def line(number: int, board_us: int) -> BatteryLine:
    return BatteryLine(number % 65536, board_us % BITS, 12_000)


@given(st.lists(st.integers(0, 99), min_size=1, max_size=80), st.integers(0, 65535))
def test_each_line_is_accepted_once_and_in_order(order: list[int], first: int) -> None:
    accept, numbers = SequenceFilter(), list[int]()
    for step, index in enumerate(order):
        received = accept.accept(line(first + index, index * 1000), step * MS)
        if received is not None:
            numbers.append(index)
    assert numbers == sorted(set(numbers)) and accept.restarts == 0
    assert accept.rejected == len(order) - len(numbers)


@given(st.integers(1, 100), st.integers(1, 30), st.lists(st.booleans(), min_size=1, max_size=60))
def test_lost_lines_are_counted(before: int, _: int, arrives: list[bool]) -> None:
    accept = SequenceFilter()
    accept.accept(line(before, 0), 0)
    last = 0
    for n, there in enumerate(arrives, 1):
        if there:
            accept.accept(line(before + n, n * 10_000), n * 10 * MS)
            last = n
    assert accept.lost == arrives[:last].count(False)


@given(st.integers(100, 60_000))
def test_a_restart_is_confirmed_by_consecutive_lines(number: int) -> None:
    accept, late = SequenceFilter(), 60_000 * MS
    for n in range(5):
        accept.accept(line(number + n, 3_000_000_000 + n * 10_000), n * 10 * MS)
    found = [accept.accept(line(n, n * 10_000), late + n * 10 * MS) for n in range(30)]
    accepted = [one for one in found if one is not None]
    assert accept.restarts == 1 and accepted[0].restarted
    assert not any(one.restarted for one in accepted[1:])
