"""Levels with hysteresis, and a consumption that is learnt from the log."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.battery.consumption import (
    DRIVING_BOUNDS,
    LOWEST_BY_VOLTAGE,
    STANDING_BOUNDS,
    Consumption,
    ConsumptionEstimator,
    Window,
)
from chefbot.battery.gauge import Reading
from chefbot.battery.monitor import BatteryLevel, BatteryMonitor
from chefbot.battery.pack import BatteryPack
from chefbot.battery.params import BatteryParams
from chefbot.robot.load import load_robot

PRIOR = Consumption(28.0, 20.0, 5.0)
PACK = BatteryPack.of(load_robot("chefbot"), 414_720.0)
SPAN = PACK.full_voltage - PACK.empty_voltage


def monitor_at(charge: float) -> BatteryMonitor:
    monitor = BatteryMonitor(PACK, BatteryParams(), PRIOR)
    show(monitor, charge, 0.0)
    return monitor


def show(monitor: BatteryMonitor, charge: float, time: float) -> None:
    """Let the monitor see a voltage for a while; the reading is noisy as a converter's is."""
    sag = PACK.resistance * (PRIOR.driving_power - PRIOR.standing) / PACK.nominal_voltage
    voltage = PACK.empty_voltage + SPAN * charge + sag
    for i in range(200):
        monitor.update(Reading(time + i, voltage + 0.001 * (i % 2), math.nan, 0.0, 0.0))


@pytest.mark.parametrize(
    ("charge", "level"), [(0.9, "ok"), (0.35, "warn"), (0.2, "return"), (0.1, "park"), (0.0, "park")]
)
def test_the_level_follows_the_charge(charge: float, level: str) -> None:
    assert monitor_at(charge).assessment.level.value == level


def test_a_level_ends_only_well_above_its_share() -> None:
    monitor = monitor_at(0.9)
    for time, charge, level in ((200.0, 0.2, "return"), (400.0, 0.3, "return"), (5000.0, 0.95, "ok")):
        show(monitor, charge, time)
        assert monitor.assessment.level is BatteryLevel(level), charge


def test_no_energy_for_parking_is_planned_with() -> None:
    known = monitor_at(0.5).assessment
    expected = (known.charge - BatteryParams().park) * PACK.energy
    assert known.energy == pytest.approx(expected)
    assert monitor_at(0.05).assessment.energy == 0.0


def test_the_description_names_the_voltage_fault_and_the_range() -> None:
    monitor = monitor_at(0.9)
    show(monitor, 0.3, 200.0)
    known = monitor.assessment
    assert (
        known.voltage_fault
        and known.voltage_fault in known.description
        and f"{known.range:.0f} m" in known.description
    )


@settings(max_examples=30)
@given(st.floats(20.0, 60.0), st.floats(10.0, 60.0))
def test_consumption_is_learnt_with_a_measured_current(standing: float, per_metre: float) -> None:
    estimator = ConsumptionEstimator(PRIOR)
    for i in range(60):
        distance = 60.0 * (i % 3)
        energy = standing * 300.0 + per_metre * distance
        estimator.add(Window(300.0, 4.0 * distance, distance, energy, by_current=True), 0.02 * energy)
    assert estimator.value.standing == pytest.approx(standing, rel=0.05)
    assert estimator.value.per_metre == pytest.approx(per_metre, rel=0.15)
    assert estimator.value.seconds_per_metre == pytest.approx(4.0, rel=0.05)


@given(st.lists(st.floats(-1e7, 1e7), max_size=10), st.booleans())
def test_learnt_values_stay_plausible(energies: list[float], by_current: bool) -> None:
    estimator = ConsumptionEstimator(PRIOR)
    for energy in energies:
        estimator.add(Window(3600.0, 100.0, 50.0, energy, by_current), 0.15 * abs(energy) + 1.0)
    lowest = 0.0 if by_current or not energies else LOWEST_BY_VOLTAGE
    value = estimator.value
    assert max(STANDING_BOUNDS[0], lowest) * 28.0 <= value.standing <= STANDING_BOUNDS[1] * 28.0
    assert max(DRIVING_BOUNDS[0], lowest) * 20.0 <= value.per_metre <= DRIVING_BOUNDS[1] * 20.0


def test_an_aged_pack_is_learnt_by_one_discharge() -> None:
    monitor, charge = BatteryMonitor(PACK, BatteryParams(), PRIOR), 0.95
    power, capacity = 28.0, 0.6 * PACK.energy
    time = 0.0
    while charge > 0.25:
        time += 5.0
        charge -= 5.0 * power / capacity
        voltage = PACK.empty_voltage + SPAN * charge
        monitor.update(Reading(time, voltage, math.nan, 0.0, 0.0))
    assert monitor.log.windows == 1
    assert monitor.log.consumption.standing == pytest.approx(28.0 / 0.6, rel=0.2)


def test_what_was_learnt_is_kept() -> None:
    first = BatteryMonitor(PACK, BatteryParams(), PRIOR)
    show(first, 0.7, 0.0)
    log = first.log._replace(consumption=Consumption(40.0, 30.0, 6.0))
    again = BatteryMonitor(PACK, BatteryParams(), PRIOR, log)
    assert again.log.consumption == Consumption(40.0, 30.0, 6.0)
    wild = BatteryMonitor(PACK, BatteryParams(), PRIOR, log._replace(consumption=Consumption(1e9, 0.0, 0.0)))
    assert wild.log.consumption.standing == STANDING_BOUNDS[1] * 28.0
