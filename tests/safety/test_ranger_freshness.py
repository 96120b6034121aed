"""The ultrasonic ranger: when it is silent, late, frozen or in the future, and when equal ranges are right."""

from __future__ import annotations

import math

import pytest

from chefbot.msgs.sensor_msgs import Range
from chefbot.msgs.std_msgs import Header
from chefbot.safety.ranger_freshness import FROZEN_ECHOES, NOISY_ECHOES, RangerMonitor

MS = 1_000_000


def echo(distance: float, time_ms: int) -> Range:
    return Range(Header.of(time_ms * MS, "ultrasonic_link"), 0, 0.5, 0.02, 4.0, distance)


def noisy_ranger(echoes: int = NOISY_ECHOES + 1) -> tuple[RangerMonitor, int]:
    """Return a ranger that has sent ranges each unlike the one before, ten times a second, and the time in ms."""
    ranger = RangerMonitor(0.1)
    for k in range(echoes):
        ranger.process_echo(echo(1.0 + 0.001 * k, 100 * k), 100 * k * MS)
    return ranger, 100 * (echoes - 1)


def repeat(ranger: RangerMonitor, distance: float, begin_ms: int, count: int) -> str:
    """Send a range again and again, and return the fault at the end."""
    for k in range(1, count + 1):
        ranger.process_echo(echo(distance, begin_ms + 100 * k), (begin_ms + 100 * k) * MS)
    return ranger.fault((begin_ms + 100 * count) * MS)


def test_a_frozen_ranger_is_distinguished_from_a_noiseless_one() -> None:
    noisy, begin = noisy_ranger()
    exact = RangerMonitor(0.1)
    repeat(exact, 1.0, 0, NOISY_ECHOES)
    assert repeat(noisy, 1.5, begin, FROZEN_ECHOES) == ""
    assert repeat(exact, 1.5, begin, 5 * FROZEN_ECHOES) == "", "a simulated ranger without noise is healthy"
    now = begin + 100 * (FROZEN_ECHOES + 1)
    assert repeat(noisy, 1.5, now - 100, 1) == (
        "The ultrasonic ranger is frozen: it keeps sending the same range."
    )
    noisy.process_echo(echo(math.inf, now), now * MS)
    assert noisy.fault(now * MS) == "", "nothing in range repeats on a working ranger"
    assert repeat(noisy, math.inf, now, 3 * FROZEN_ECHOES) == ""


@pytest.mark.parametrize(("echoes", "frozen"), [(20, True), (19, False)])
def test_twenty_ranges_without_a_repetition_show_noise(echoes: int, frozen: bool) -> None:
    ranger, begin = noisy_ranger(echoes)
    repeat(ranger, 1.0 + 0.001 * (echoes - 1), begin, 8)
    assert bool(ranger.fault((begin + 800) * MS)) == frozen


@pytest.mark.parametrize("between", [math.inf, 1.018])
def test_the_twenty_ranges_are_in_a_row(between: float) -> None:
    """Neither an empty cone nor a repetition may lie between them; and equal ones freeze only in a row."""
    ranger, begin = noisy_ranger(19)
    ranger.process_echo(echo(between, begin), begin * MS)
    ranger.process_echo(echo(1.5, begin), begin * MS)
    assert repeat(ranger, 1.5, begin, 20) == ""
    noisy, begin = noisy_ranger()
    for k in range(6):
        assert repeat(noisy, 1.5 + 0.1 * (k % 2), begin + 500 * k, 5) == ""


def test_a_tenth_of_a_second_of_repetition_is_not_noise() -> None:
    """Ranges in pairs, as of a ranger that is read twice as often as it measures, do not show noise."""
    ranger = RangerMonitor(0.1)
    for k in range(100):
        ranger.process_echo(echo(1.0 + 0.001 * (k // 2), 100 * k), 100 * k * MS)
    assert repeat(ranger, 2.0, 10_000, 12) == ""


@pytest.mark.parametrize(
    ("period", "limit_ms", "limit"), [(0.1, 300, "0.3 s"), (0.05, 200, "0.2 s"), (0.5, 1500, "1.5 s")]
)
def test_three_periods_without_an_echo_are_a_fault(period: float, limit_ms: int, limit: str) -> None:
    ranger = RangerMonitor(period)
    assert not ranger.has_sent and ranger.fault(0) == "The ultrasonic ranger has not sent anything yet."
    ranger.process_echo(echo(1.0, 1000), 1000 * MS)
    assert ranger.has_sent and ranger.fault((1000 + limit_ms) * MS) == ""
    late = (1000 + limit_ms) * MS + 1
    assert ranger.fault(late) == f"The ultrasonic ranger has sent nothing for more than {limit}."
    ranger.process_echo(echo(1.0, 1000), late)
    assert ranger.fault(late) == f"The ultrasonic ranger's data come late: they are more than {limit} old."


@pytest.mark.parametrize(("ahead_ms", "fault"), [(100, False), (101, True)])
def test_echoes_of_the_future_are_a_fault(ahead_ms: int, fault: bool) -> None:
    ranger = RangerMonitor(0.1)
    ranger.process_echo(echo(1.0, 1400 + ahead_ms), 1400 * MS)
    assert ("in the future" in ranger.fault(1400 * MS)) == fault
