"""Times and metres of the stops that are left, from drives and stops so far."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.delivery.params import DeliveryParams
from chefbot.delivery.round_forecast import (
    MEMORY,
    PRIOR_LENGTH,
    DriveTimes,
    Pace,
    StopTimes,
    forecast_stops,
)
from chefbot.msgs.chefbot_msgs import BatteryStatus, DeliveryStatus

BATTERY = BatteryStatus(charge=0.8, standing_power=10.0, energy_per_metre=20.0)
LEGS = st.lists(st.tuples(st.floats(0, 100), st.floats(0, 600)), min_size=1, max_size=9)


def status(state: str, hold_reason: str = "") -> DeliveryStatus:
    return DeliveryStatus(state=state, hold_reason=hold_reason)


@given(legs=LEGS, pace=st.floats(0.5, 20.0))
def test_each_stop_is_behind_the_one_before(legs: list[tuple[float, float]], pace: float) -> None:
    names = [f"table_{i}" for i in range(len(legs))]
    stops = forecast_stops(
        names, [leg for leg, _ in legs], 0.0, [stay for _, stay in legs], Pace(pace, BATTERY, 1e5)
    )
    assert [stop.place for stop in stops] == names
    for before, after in itertools.pairwise(stops):
        assert after.distance >= before.distance and after.time >= before.time
        assert 0.0 <= after.charge <= before.charge <= BATTERY.charge
    assert stops[-1].distance == pytest.approx(sum(leg for leg, _ in legs), rel=1e-5, abs=1e-5)


def test_a_stop_costs_its_leg_and_the_stops_before() -> None:
    one, two = forecast_stops(("a", "b"), (10.0, 5.0), 0.0, (60.0, 0.0), Pace(4.0, BATTERY, 10_000.0))
    assert (one.distance, one.time) == (10.0, 40.0) and (two.distance, two.time) == (15.0, 120.0)
    assert one.charge == pytest.approx(0.8 - (40 * 10 + 10 * 20) / 10_000)
    assert two.charge == pytest.approx(0.8 - (120 * 10 + 15 * 20) / 10_000)


def test_a_stop_without_a_path_is_left_out() -> None:
    pace, legs, stays = Pace(4.0, BATTERY, 10_000.0), (10.0, math.inf, 5.0), (60.0, 99.0, 0.0)
    one, other, two = forecast_stops(("a", "b", "c"), legs, 0.0, stays, pace)
    assert (one.reachable, other.reachable, two.reachable) == (True, False, True)
    without = forecast_stops(("a", "c"), (10.0, 5.0), 0.0, (60.0, 0.0), pace)
    assert [stop.time for stop in (one, two)] == [stop.time for stop in without]
    assert [stop.distance for stop in (one, two)] == [stop.distance for stop in without]


def test_without_a_battery_monitor_the_charge_is_not_known() -> None:
    (stop,) = forecast_stops(("a",), (10.0,), 0.0, (0.0,), Pace(4.0, None, 10_000.0))
    assert stop.charge == -1.0


@pytest.mark.parametrize("actual", [2.0, 9.0])
def test_the_time_of_a_metre_is_that_of_the_drives(actual: float) -> None:
    times = DriveTimes(4.0)
    now = 0.0
    for drive in range(30):
        times.begin(20.0, now)
        now += 20.0 * actual
        times.end(now, arrived=True)
        share = 0.5 ** ((drive + 1) * 20.0 / MEMORY) * PRIOR_LENGTH / (PRIOR_LENGTH + (drive + 1) * 20.0)
        assert abs(times.seconds_per_metre - actual) <= abs(4.0 - actual) * max(0.35, share)
    assert times.seconds_per_metre == pytest.approx(actual, rel=0.05)


def test_an_interrupted_drive_does_not_count() -> None:
    times = DriveTimes(4.0)
    times.begin(20.0, 0.0)
    times.end(1.0, arrived=False)
    times.end(500.0, arrived=True)
    times.begin(math.inf, 500.0)
    times.end(900.0, arrived=True)
    assert times.seconds_per_metre == 4.0


def test_a_stop_takes_as_long_as_those_before() -> None:
    times = StopTimes(DeliveryParams(stop_time=60.0))
    assert times.expected(at_kitchen=True) == times.expected(at_kitchen=False) == 60.0
    times.update(status("waiting"), 100.0)
    assert times.rest(100.0) == 60.0 and times.rest(130.0) == 30.0 and times.rest(500.0) == 0.0
    times.update(status("driving"), 120.0)
    assert times.rest(120.0) == 0.0
    assert times.expected(at_kitchen=False) == 20.0 and times.expected(at_kitchen=True) == 60.0
    times.update(status("waiting"), 200.0)
    times.update(status("driving"), 230.0)
    assert times.expected(at_kitchen=False) == pytest.approx(23.0)


def test_the_timers_of_the_owner_are_what_a_stop_takes() -> None:
    times = StopTimes(DeliveryParams(loading_timeout=15.0, pickup_timeout=5.0))
    assert times.expected(at_kitchen=True) == 15.0 and times.expected(at_kitchen=False) == 5.0


def test_a_stop_that_is_held_ends() -> None:
    times = StopTimes(DeliveryParams())
    times.update(status("waiting"), 0.0)
    times.update(status("waiting", "stop"), 30.0)
    times.update(status("waiting", "choice"), 400.0)
    assert times.rest(400.0) == 0.0 and times.expected(at_kitchen=False) == 30.0
