"""The choice from the catalogue, and what the geometry has to follow with."""

from __future__ import annotations

import msgspec
import pytest

from chefbot.design.sizing.component_selection import Verdict, best_with, choose, nearest, settled, verdicts
from chefbot.design.sizing.dependent_dimensions import moved_sensors, with_motor, with_radius
from chefbot.design.sizing.mounting_clearance import battery_clearance
from chefbot.design.sizing.requirements import judge
from chefbot.design.sizing.stability import loaded
from chefbot.design.sizing.suggested_fixes import geometry_fixes, stable_radius
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.geometry import layout
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.section import Size
from chefbot.robot.spec import Robot

CHEFBOT = load_robot("chefbot")
CATALOGUE = load_catalogue()


def with_requirements(robot: Robot, payload: float, speed: float) -> Robot:
    body = msgspec.structs.replace(robot.body, payload=payload)
    return msgspec.structs.replace(
        robot, body=body, drive=msgspec.structs.replace(robot.drive, max_speed=speed)
    )


@pytest.fixture(scope="module")
def sets() -> list[Verdict]:
    return verdicts(CHEFBOT, CATALOGUE)


def test_every_component_set_is_evaluated(sets: list[Verdict]) -> None:
    drivers = {name for name, driver in CATALOGUE.drivers.items() if not driver.obsolete}
    assert len(drivers) < len(CATALOGUE.drivers) and {verdict.parts.driver for verdict in sets} == drivers
    wanted = len(CATALOGUE.motors) * len(drivers) * len(CATALOGUE.batteries)
    assert len({verdict.parts for verdict in sets}) == wanted


def test_a_robot_keeps_the_obsolete_driver_that_it_has() -> None:
    driver = next(driver for driver in CATALOGUE.drivers.values() if driver.obsolete)
    own = msgspec.structs.replace(CHEFBOT, driver=driver)
    assert any(verdict.robot.driver == driver for verdict in verdicts(own, CATALOGUE))


def test_the_choice_meets_its_criterion(sets: list[Verdict]) -> None:
    chosen = choose(sets)
    assert chosen is not None
    assert chosen.passed
    passing = [verdict for verdict in sets if verdict.passed]
    lightest = min(verdict.mass for verdict in passing)
    assert chosen.mass <= 1.1 * lightest
    assert all(v.power >= chosen.power for v in passing if v.mass <= 1.1 * lightest)


def another_motor(verdict: Verdict, **values: float) -> Verdict:
    motor = msgspec.structs.replace(verdict.robot.motor, **values)
    return verdict._replace(robot=msgspec.structs.replace(verdict.robot, motor=motor))


def test_the_best_efficiency_among_the_nearly_lightest_wins(sets: list[Verdict]) -> None:
    one = choose(sets)
    assert one is not None
    motor = one.robot.motor
    thrifty = another_motor(one, mass=motor.mass + 0.001, no_load_current=0.5 * motor.no_load_current)
    heavy = another_motor(one, mass=motor.mass + 0.2, no_load_current=0.1 * motor.no_load_current)
    assert choose([one, thrifty, heavy]) == choose([heavy, thrifty, one]) == thrifty


def test_failed_sets_have_a_reason_and_passing_ones_none(sets: list[Verdict]) -> None:
    assert all(bool(verdict.failures) != verdict.passed for verdict in sets)
    assert all(verdict.lack > 0.0 for verdict in sets if not verdict.passed)


def test_a_component_is_judged_with_good_partners(sets: list[Verdict]) -> None:
    slow = best_with(sets, "motor", "pololu_37d_131")
    assert {check.part for check in slow.failures} == {"motor"}
    weak = best_with(sets, "driver", "tb6612fng")
    assert {check.part for check in weak.failures} == {"driver"}
    assert best_with(sets, "battery", "lifepo4_12v8_10ah").passed


def test_the_mass_follows_the_components(sets: list[Verdict]) -> None:
    by_parts = {verdict.parts: verdict for verdict in sets}
    one = by_parts[sets[0].parts._replace(battery="lead_12v_12ah")]
    other = by_parts[sets[0].parts._replace(battery="lifepo4_12v8_10ah")]
    difference = one.robot.battery.mass - other.robot.battery.mass
    assert one.load.mass - other.load.mass == pytest.approx(difference)
    assert one.mass - other.mass == pytest.approx(difference)


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_built_in_robots_pass_every_check(name: str) -> None:
    robot = load_robot(name)
    assert [check for check in judge(robot, loaded(robot)) if not check.passed] == []


def test_load_estimates_agree_with_the_solids(sets: list[Verdict]) -> None:
    for verdict in sets[:: len(sets) // 12]:
        exact = loaded(verdict.robot)
        assert verdict.load.mass == pytest.approx(exact.mass, abs=0.005)
        assert verdict.load[1:] == pytest.approx(exact[1:], abs=0.001)
    choice = settled(sets)
    assert choice is not None
    assert choice.load == loaded(choice.robot)
    assert choice.passed


def test_nothing_passes_for_a_robot_beyond_the_catalogue() -> None:
    sets = verdicts(with_requirements(CHEFBOT, 60.0, 2.0), CATALOGUE)
    assert choose(sets) is None
    closest = nearest(sets)
    assert closest.lack == min(verdict.lack for verdict in sets)
    assert geometry_fixes(sets, set()) == []


def test_remedies_change_only_open_geometry_values() -> None:
    sets = verdicts(with_requirements(CHEFBOT, 2.0, 0.35), CATALOGUE)
    thick = [verdict for verdict in sets if verdict.parts.motor.startswith("gobilda")]
    (change,) = geometry_fixes(thick, set())
    assert change.path == ("wheels", "diameter")
    assert geometry_fixes(thick, {("wheels", "diameter")}) == []
    slow = [verdict for verdict in sets if verdict.parts.motor == "pololu_37d_131"]
    assert geometry_fixes(slow, set()) == []


def test_a_larger_plate_prevents_tipping() -> None:
    heavy = with_requirements(CHEFBOT, 6.0, 0.6)
    tall = msgspec.structs.replace(heavy, body=msgspec.structs.replace(heavy.body, payload_height=0.4))
    radius = stable_radius(tall)
    assert radius is not None
    assert radius > tall.body.radius
    grown = with_radius(tall, radius)
    assert grown.wheels.separation - tall.wheels.separation == pytest.approx(
        2.0 * (radius - tall.body.radius)
    )
    assert grown.casters.offset - tall.casters.offset == pytest.approx(radius - tall.body.radius)


def test_sensors_rise_with_the_plates_on_a_thicker_motor() -> None:
    thick = msgspec.structs.replace(CHEFBOT.motor, diameter=CHEFBOT.motor.diameter + 0.01)
    driven = with_motor(CHEFBOT, thick)
    rise = layout.plate_undersides(driven)[0] - layout.plate_undersides(CHEFBOT)[0]
    assert rise == pytest.approx(0.005)
    for frame, sensor in CHEFBOT.sensors.by_frame.items():
        assert driven.sensors.by_frame[frame].mount.z == pytest.approx(sensor.mount.z + rise)
    changes = moved_sensors(CHEFBOT, driven)
    assert len(changes) == len(CHEFBOT.sensors.by_frame)


@pytest.mark.parametrize(("x", "y"), [(0.3, 0.01), (0.01, 0.3)])
def test_a_battery_that_is_too_long_does_not_fit(x: float, y: float) -> None:
    size = msgspec.structs.replace(CHEFBOT.battery.size, x=x, y=y)
    assert battery_clearance(CHEFBOT) >= 0.0
    assert battery_clearance(but_battery(size)) < 0.0


def test_a_battery_too_high_or_on_the_driver_does_not_fit() -> None:
    tall = msgspec.structs.replace(CHEFBOT.battery.size, z=CHEFBOT.tubes.length + 0.001)
    assert battery_clearance(but_battery(tall)) == pytest.approx(-0.001)
    places = msgspec.structs.replace(CHEFBOT.places, battery=CHEFBOT.places.driver)
    assert battery_clearance(msgspec.structs.replace(CHEFBOT, places=places)) < 0.0


def but_battery(size: Size) -> Robot:
    return msgspec.structs.replace(CHEFBOT, battery=msgspec.structs.replace(CHEFBOT.battery, size=size))
