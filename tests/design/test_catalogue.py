"""Every component of the catalogue could exist, and names the source of its figures."""

from __future__ import annotations

import pytest

from chefbot.robot.catalogue import load_catalogue

CATALOGUE = load_catalogue()
EVERYTHING = {**CATALOGUE.motors, **CATALOGUE.drivers, **CATALOGUE.batteries}


def test_catalogue_has_enough_components() -> None:
    assert len(CATALOGUE.motors) >= 12
    assert len(CATALOGUE.drivers) >= 4
    assert len(CATALOGUE.batteries) >= 4


@pytest.mark.parametrize("name", EVERYTHING)
def test_every_component_names_its_source(name: str) -> None:
    source = EVERYTHING[name].source
    assert len(source) > 40
    assert any(
        word in source.lower() for word in ("data sheet", ".com", "guide", "wiki", "page", "estimated")
    )


@pytest.mark.parametrize("name", CATALOGUE.motors)
def test_every_motor_could_exist(name: str) -> None:
    motor = CATALOGUE.motors[name]
    at_half_speed = motor.stall_torque / 2.0 * motor.no_load_speed / 2.0
    assert 0.0 < at_half_speed <= 0.5 * motor.stall_current * motor.voltage
    assert motor.no_load_current < 0.2 * motor.stall_current
    assert motor.continuous_torque <= 0.25 * motor.stall_torque * (1.0 + 1e-9)
    assert motor.ticks_per_turn == pytest.approx(motor.gear_ratio * motor.encoder_counts)
    assert motor.encoder_counts % 4 == 0
    assert 3000.0 < motor.no_load_speed * motor.gear_ratio * 9.5493 < 36_000.0, "rpm of the rotor"
    assert motor.shaft_offset + motor.shaft_diameter / 2.0 < motor.diameter / 2.0
    volume = 0.7854 * motor.diameter**2 * motor.length
    assert 1000.0 < motor.mass / volume < 8000.0, "kg/m^3"


@pytest.mark.parametrize("name", CATALOGUE.drivers)
def test_every_driver_could_exist(name: str) -> None:
    driver = CATALOGUE.drivers[name]
    assert driver.voltage_min < driver.voltage_max
    assert driver.continuous_current <= driver.peak_current
    assert driver.logic_high_min < 5.0


@pytest.mark.parametrize("name", CATALOGUE.batteries)
def test_every_battery_could_exist(name: str) -> None:
    battery = CATALOGUE.batteries[name]
    assert battery.empty_voltage < battery.voltage < battery.full_voltage
    energy_per_mass = battery.capacity * battery.voltage / battery.mass / 3600.0
    limits = {"lead": (25, 50), "LiFe": (80, 140), "Li-i": (150, 270), "LiPo": (110, 220), "NiMH": (40, 110)}
    low, high = limits[battery.chemistry[:4]]
    assert low < energy_per_mass < high, "Wh/kg"
    volume = battery.size.x * battery.size.y * battery.size.z
    assert 700.0 < battery.mass / volume < 4000.0, "kg/m^3"
