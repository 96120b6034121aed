"""The gauge: the smaller of voltage and count, and the fault of the voltage reading."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.battery.consumption import Consumption
from chefbot.battery.gauge import COUNT_MARGIN, FROZEN, NO_READING, ChargeGauge, Reading, Stored
from chefbot.battery.pack import BatteryPack
from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
PACK = BatteryPack.of(ROBOT, 414_720.0)
USE = Consumption(28.0, 20.0, 5.0)
SPAN = PACK.full_voltage - PACK.empty_voltage
HOUR = 3600.0


class Discharge:
    """A true pack with linear voltage whose gauge is read every 5 s; `lie` changes what is measured."""

    def __init__(self, charge: float = 0.9, *, stored: Stored | None = None, continued: bool = False) -> None:
        self.gauge, self.charge, self.time = ChargeGauge(PACK, stored, continued=continued), charge, 0.0

    def change_pack(self, charge: float) -> Discharge:
        """Switch off, change the pack, and switch on a minute later."""
        self.charge, self.time = charge, self.time + 60.0
        return self

    def run(
        self,
        seconds: float,
        lie: Callable[[float], float] = lambda v: v,
        speed: float = 0.0,
        rate: float = 0.0,
    ) -> Discharge:
        """Use the robot; `rate`: charging, share per second."""
        for _ in range(round(seconds / 5.0)):
            self.time += 5.0
            power = USE.standing + USE.per_metre * speed
            self.charge += (rate - power / PACK.energy) * 5.0
            voltage = PACK.empty_voltage + SPAN * self.charge - PACK.resistance * power / PACK.nominal_voltage
            self.gauge.update(Reading(self.time, round(lie(voltage), 3), math.nan, 5.0 * speed, 5.0), USE)
        return self


def test_an_honest_gauge_shows_what_is_left_under_load() -> None:
    one = Discharge().run(2 * HOUR)
    sag = PACK.resistance * USE.driving_power / PACK.nominal_voltage / SPAN
    margin = (COUNT_MARGIN - 1.0) * 2 * HOUR * USE.standing / PACK.energy
    assert one.gauge.measured == pytest.approx(one.charge - sag, abs=0.01) and not one.gauge.voltage_fault
    assert one.charge - sag - margin - 0.01 <= one.gauge.charge <= one.charge - sag + 0.01


@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 0.9), st.floats(0.05, 0.6), st.booleans())
def test_a_reading_that_lies_high_never_lengthens(charge: float, more: float, drives: bool) -> None:
    one = Discharge(charge).run(600.0)
    one.run(HOUR, lambda v: v + more * SPAN, speed=0.2 if drives else 0.0)
    assert one.gauge.charge <= one.charge + 0.02


def test_a_constant_high_reading_is_named_and_not_believed() -> None:
    one = Discharge(0.5).run(600.0).run(HOUR, lambda _: 14.2)
    assert one.gauge.voltage_fault == FROZEN and one.gauge.charge < one.charge + 0.01


def test_a_constant_reading_from_the_first_is_half_at_most() -> None:
    one = Discharge(0.5).run(HOUR, lambda _: 14.5)
    assert one.gauge.voltage_fault == FROZEN and one.gauge.charge < 0.5
    stored = Discharge(0.5, stored=Stored(0.3, 0.3)).run(HOUR, lambda _: 14.5)
    assert stored.gauge.charge < 0.3


def test_a_low_reading_is_believed_at_once_and_named() -> None:
    one = Discharge(0.9).run(600.0).run(120.0, lambda v: v - 0.6 * SPAN)
    assert one.gauge.charge < 0.35 and "weak or cold" in one.gauge.voltage_fault
    one.run(300.0)
    assert one.gauge.charge > 0.77 and not one.gauge.voltage_fault, (
        "the voltage is back, and the count always fitted"
    )


def test_a_charge_that_rises_while_driving_is_not_charging() -> None:
    one = Discharge(0.4).run(600.0, speed=0.2).run(HOUR, lambda v: v + 0.3 * SPAN, speed=0.2)
    assert one.gauge.charge <= one.charge + 0.02 and "without being charged" in one.gauge.voltage_fault


@pytest.mark.parametrize("hours", [1.0, 3.0, 8.0])
def test_charging_is_believed_of_a_robot_that_stands(hours: float) -> None:
    one = Discharge(0.2).run(600.0)
    one.run(0.6 * hours * HOUR, rate=1.0 / (hours * HOUR) + USE.standing / PACK.energy)
    one.run(300.0)
    assert one.gauge.charge == pytest.approx(one.charge, abs=0.06) and not one.gauge.voltage_fault


def test_the_voltage_after_a_drive_is_not_charging() -> None:
    """An old pack recovers slowly when the robot stops; with a reading that lies high that looked like a charger."""
    one, more = Discharge(0.7).run(600.0), 0.2 * SPAN
    for _ in range(20):
        one.run(120.0, lambda v: v + more - 0.05 * SPAN, speed=0.2)
        for recovered in (0.04, 0.03, 0.02, 0.01, 0.0, 0.0):
            one.run(10.0, lambda v, sag=recovered: v + more - sag * SPAN)
        one.run(240.0, lambda v: v + more)
    assert one.gauge.anchors == 1 and one.gauge.charge <= one.charge + 0.02


def test_a_changed_pack_is_believed() -> None:
    one = Discharge(0.2).run(600.0)
    one.change_pack(0.7).run(300.0)
    assert one.gauge.charge > 0.62 and not one.gauge.voltage_fault


@pytest.mark.parametrize("charge", [0.6, 0.95])
def test_a_sudden_rise_without_a_pause_is_not_charging(charge: float) -> None:
    one = Discharge(0.3).run(600.0)
    one.charge = charge
    one.run(1800.0)
    assert one.gauge.charge < 0.3 and "without being charged" in one.gauge.voltage_fault


def test_a_restarted_process_counts_on() -> None:
    assert Discharge(0.8, stored=Stored(0.4, 0.4), continued=True).run(60.0).gauge.charge < 0.4
    assert Discharge(0.8, stored=Stored(0.4, 0.4)).run(60.0).gauge.charge > 0.7
    flat = Discharge(0.6, stored=Stored(0.2, 0.6)).run(60.0)
    assert flat.gauge.charge < 0.2, "the voltage has not risen: nobody has charged it"


def test_without_a_reading_the_use_is_counted() -> None:
    gauge = ChargeGauge(PACK)
    assert gauge.charge == 0.0 and gauge.voltage_fault == NO_READING
    one = Discharge(0.9).run(600.0).run(HOUR, lambda _: math.nan)
    assert one.gauge.voltage_fault == NO_READING and one.charge - 0.08 < one.gauge.charge < one.charge


@pytest.mark.parametrize("voltage", [-3.0, 0.0, 1.5, 40.0])
def test_a_voltage_that_no_running_robot_has_is_not_a_reading(voltage: float) -> None:
    one = Discharge(0.9).run(600.0).run(60.0, lambda _: voltage)
    assert one.gauge.voltage_fault == NO_READING and one.charge - 0.08 < one.gauge.charge < one.charge
    assert one.run(60.0).gauge.voltage_fault == ""


@pytest.mark.parametrize("current", [1e30, -1e30, math.inf, math.nan])
def test_an_absurd_current_is_not_counted(current: float) -> None:
    one = Discharge(0.9).run(600.0)
    one.gauge.update(Reading(one.time + 5.0, 14.0, current, 0.0, 0.0), USE)
    one.run(600.0)
    assert one.gauge.charge == pytest.approx(one.charge, abs=0.05)


def test_a_measured_current_is_counted() -> None:
    gauge = ChargeGauge(PACK)
    for i in range(720):
        gauge.update(Reading(5.0 * i, 14.0 - 1e-4 * i, 5.0, 0.0, 0.0), USE)
    assert gauge.anchor - gauge.counted == pytest.approx(
        COUNT_MARGIN * 5.0 * 14.0 * HOUR / PACK.energy, rel=0.02
    )
