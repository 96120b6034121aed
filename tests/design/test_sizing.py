"""The calculations: the chapter's printed numbers, free bodies by hand, and what must hold whatever the robot."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chefbot.design.sizing import dc_motor, energy_budget, forces, sizing
from chefbot.design.sizing.calculation import Result
from chefbot.design.sizing.chapter_method import chapter_method
from chefbot.design.sizing.requirements import SPEED_RESERVE, judge, motor_checks
from chefbot.design.sizing.stability import Load, loaded, room, support, tipping
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import robot_mass_properties
from chefbot.robot.load import load_robot
from chefbot.robot.spec import DRIVE_EFFICIENCY, GRAVITY, Robot

CHEFBOT = load_robot("chefbot")
CATALOGUE = load_catalogue()
MOTORS = list(CATALOGUE.motors)


def but(robot: Robot, **sections: dict[str, Any]) -> Robot:
    """The robot with other values in some of its sections."""
    for section, values in sections.items():
        part = msgspec.structs.replace(getattr(robot, section), **values)
        robot = msgspec.structs.replace(robot, **{section: part})
    return robot


robots = st.builds(
    lambda payload, speed, slope, acceleration, wheel, motor, battery: msgspec.structs.replace(
        but(
            CHEFBOT,
            body={"payload": payload},
            drive={"max_speed": speed, "max_slope": slope, "max_acceleration": acceleration},
            wheels={"diameter": wheel},
        ),
        motor=CATALOGUE.motors[motor],
        battery=CATALOGUE.batteries[battery],
    ),
    st.floats(0.1, 20.0),
    st.floats(0.05, 1.5),
    st.floats(0.0, 0.3),
    st.floats(0.05, 2.0),
    st.floats(0.05, 0.3),
    st.sampled_from(MOTORS),
    st.sampled_from(list(CATALOGUE.batteries)),
)
masses = st.floats(0.3, 60.0)


def evaluated(result: Result) -> float:
    """What the printed working comes to."""
    known = {name: getattr(math, name) for name in ("sin", "cos", "tan", "ceil")}
    return float(eval(result.numbers.replace("^", "**"), {"__builtins__": {}}, known))


def by_name(results: list[Result]) -> dict[str, Result]:
    return {result.name: result for result in results}


# -- the chapter


def test_the_chapter_method_gives_the_printed_numbers() -> None:
    chapter = by_name(chapter_method(but(CHEFBOT, body={"mass_budget": 3.0, "payload": 2.0})))
    assert chapter["weight"].value == pytest.approx(50.0)
    assert chapter["weight"].numbers == "(3 + 2) * 10"
    assert chapter["load on the driven wheels"].value == pytest.approx(25.0)
    assert f"{chapter['torque of each motor'].value:.3f}" == "0.675"
    assert chapter["torque of each motor"].numbers == "0.6 * 25 * 0.045"
    assert f"{chapter['the same in kg cm'].value:.2f}" == "6.88"
    assert f"{chapter['speed'].value:.2f}" == "74.31"
    assert chapter["torque to look for"].value == 10.0
    assert chapter["speed to look for"].value == 80.0


# -- every working


def robot_of(payload: float, speed: float, wheel: float, motor: str, battery: str) -> Robot:
    """A robot by which the search has found a fault."""
    robot = but(
        CHEFBOT,
        body={"payload": payload},
        drive={"max_speed": speed, "max_slope": 0.0, "max_acceleration": 1.0},
        wheels={"diameter": wheel},
    )
    return msgspec.structs.replace(robot, motor=CATALOGUE.motors[motor], battery=CATALOGUE.batteries[battery])


NEARLY_STALLED = robot_of(12.5, 1.0, 0.1796875, "pololu_37d_70", "liion_3s2p_18650")
ABOVE_A_STEP = robot_of(2.0, 0.1000001 * 3.14 / 3.0, 0.1, "pololu_37d_70", "liion_3s2p_18650")


@given(robots, masses)
@example(NEARLY_STALLED, 52.0)  # a difference of nearly equal terms
@example(ABOVE_A_STEP, 5.0)  # 20.00002 rpm, which are rounded up to 30
def test_every_printed_calculation_gives_the_printed_result(robot: Robot, mass: float) -> None:
    load = Load(mass + robot.body.payload, 0.01, -0.005, 0.2)
    results = [*chapter_method(robot), *sizing.drive_requirements(robot, load)]
    results += [*sizing.component_results(robot, load), *sizing.stability_results(robot, load)]
    calculated = [result for result in results if not result.formula.startswith("next ")]
    assert len(calculated) > 30
    for result in calculated:
        scale = max(abs(result.value), 1e-3 * max(abs(value) for value in result.symbols.values()))
        assert evaluated(result) == pytest.approx(result.value, abs=2e-3 * scale), result.name
        assert result.source and result.unit in (
            "",
            "N",
            "N m",
            "kg",
            "kg cm",
            "rpm",
            "rad/s",
            "A",
            "W",
            "J",
            "s",
            "m",
            "g",
        )


# -- forces


@given(masses, st.floats(0.0, 0.5), st.floats(-2.0, 2.0), st.floats(0.0, 0.2))
def test_the_force_is_that_of_the_free_body_diagram(
    mass: float, slope: float, a: float, rolling: float
) -> None:
    along = np.array([math.cos(slope), math.sin(slope)])
    up = np.array([-math.sin(slope), math.cos(slope)])
    weight = np.array([0.0, -mass * GRAVITY])
    floor = -weight @ up
    push = forces.force(mass, forces.Duty("", rolling, slope, a)).value
    total = weight + floor * up + (push - rolling * floor) * along
    assert total == pytest.approx(mass * a * along, abs=1e-9 * mass)


@given(robots, masses)
def test_torque_and_losses_give_the_force(robot: Robot, mass: float) -> None:
    for duty in forces.duties(robot):
        torque = forces.motor_torque(robot, mass, duty).value
        push = 2.0 * torque * DRIVE_EFFICIENCY / robot.wheel_radius
        assert push == pytest.approx(forces.force(mass, duty).value)


@given(robots, masses, st.floats(0.0, 10.0))
def test_more_load_never_needs_less_torque_or_power(robot: Robot, mass: float, more: float) -> None:
    for duty in forces.duties(robot):
        light = forces.motor_torque(robot, mass, duty).value
        assert forces.motor_torque(robot, mass + more, duty).value >= light
    assert energy_budget.mean_power(robot, mass + more).value >= energy_budget.mean_power(robot, mass).value


@given(robots, masses, st.floats(0.1, 1.0))
def test_a_passing_motor_still_passes_with_less_load(robot: Robot, mass: float, share: float) -> None:
    before = {check.name for check in motor_checks(robot, mass) if check.passed}
    after = {check.name for check in motor_checks(robot, share * mass) if check.passed}
    assert before <= after


def test_the_corrected_torque_is_that_of_the_fact_sheet() -> None:
    robot = but(CHEFBOT, wheels={"diameter": 0.09})
    duty = forces.Duty("5 degrees, carpet", 0.05, math.radians(5.0), 0.5)
    assert forces.force(5.0, duty).value == pytest.approx(9.22, abs=0.005)
    kg_cm = GRAVITY / 100.0
    assert forces.motor_torque(robot, 5.0, duty).value / kg_cm == pytest.approx(3.25, abs=0.01)
    assert forces.slip_torque(but(robot, wheels={"friction": 0.6}), 5.0).value / kg_cm == pytest.approx(
        3.37, abs=0.01
    )


# -- the motor's line


@pytest.mark.parametrize("name", MOTORS)
def test_the_motor_line_passes_through_the_data_sheet_points(name: str) -> None:
    motor = CATALOGUE.motors[name]
    assert dc_motor.speed(motor, 0.0, motor.voltage, "").value == pytest.approx(motor.no_load_speed)
    assert dc_motor.speed(motor, motor.stall_torque, motor.voltage, "").value == pytest.approx(0.0, abs=1e-9)
    assert dc_motor.current(motor, 0.0, "").value == pytest.approx(motor.no_load_current)
    assert dc_motor.current(motor, motor.stall_torque, "").value == pytest.approx(motor.stall_current)


@given(st.sampled_from(MOTORS), st.floats(0.0, 1.0), st.floats(0.3, 1.25))
def test_voltage_and_speed_conversions_are_inverse(name: str, share: float, factor: float) -> None:
    motor = CATALOGUE.motors[name]
    torque = share * motor.stall_torque
    turning = dc_motor.speed(motor, torque, factor * motor.voltage, "").value
    assert dc_motor.voltage(motor, torque, turning).value == pytest.approx(factor * motor.voltage)


@given(st.sampled_from(MOTORS), st.floats(0.0, 1.0))
def test_no_motor_has_an_efficiency_above_one(name: str, share: float) -> None:
    motor = CATALOGUE.motors[name]
    torque = share * motor.stall_torque
    shaft = torque * dc_motor.speed(motor, torque, motor.voltage, "").value
    assert shaft <= motor.voltage * dc_motor.current(motor, torque, "").value


def test_pololu_best_points_lie_on_the_line() -> None:
    """Data sheet rev. 1.2: 50:1 makes 180 rpm at 2.2 kg cm with 0.66 A, 102:1 87 rpm at 4.2 kg cm with 0.72 A."""
    for name, kg_cm, rpm, ampere in (("pololu_37d_50", 2.2, 180, 0.66), ("pololu_37d_102", 4.2, 87, 0.72)):
        motor, torque = CATALOGUE.motors[name], kg_cm * GRAVITY / 100.0
        turning = dc_motor.speed(motor, torque, motor.voltage, "").value
        assert turning * 30.0 / math.pi == pytest.approx(rpm, rel=0.02)
        assert dc_motor.current(motor, torque, "").value == pytest.approx(ampere, rel=0.25)


# -- power


@given(robots, masses)
def test_run_time_times_power_is_the_energy(robot: Robot, mass: float) -> None:
    energy = energy_budget.run_time(robot, mass).value * energy_budget.mean_power(robot, mass).value
    battery = robot.battery
    assert energy == pytest.approx(battery.capacity * battery.voltage * battery.usable)


@given(robots, masses)
def test_the_fuse_carries_the_highest_current(robot: Robot, mass: float) -> None:
    assert (
        energy_budget.fuse(robot, mass).value >= 1.25 * energy_budget.highest_draw(robot, mass).value - 1e-9
    )


# -- speed, clearance


def test_the_131_to_1_motor_is_too_slow_for_the_chapter_robot() -> None:
    robot = msgspec.structs.replace(
        but(CHEFBOT, wheels={"diameter": 0.09}, drive={"max_speed": 0.35}),
        motor=CATALOGUE.motors["pololu_37d_131"],
        battery=CATALOGUE.batteries["lifepo4_12v8_10ah"],
    )
    speed = by_name_of_checks(robot, 5.0)["speed with reserve"]
    assert not speed.passed
    assert speed.bound == pytest.approx(SPEED_RESERVE * 0.35 / 0.045)
    quick = msgspec.structs.replace(robot, motor=CATALOGUE.motors["pololu_37d_70"])
    assert by_name_of_checks(quick, 5.0)["speed with reserve"].passed


def by_name_of_checks(robot: Robot, mass: float) -> dict[str, Any]:
    return {check.name: check for check in motor_checks(robot, mass)}


@given(robots, masses, st.floats(0.5, 2.0))
def test_each_bound_is_exact(robot: Robot, mass: float, share: float) -> None:
    """A component just above its bound passes that check, just below it fails."""
    torque = forces.motor_torque(robot, mass, forces.climb(robot)).value
    stalled = robot.motor.stall_current * robot.battery.full_voltage / robot.motor.voltage
    bounds: list[tuple[str, str, str, float, bool]] = [
        ("driver", "voltage_max", "highest voltage", robot.battery.full_voltage, True),
        ("driver", "voltage_min", "lowest voltage", robot.battery.empty_voltage, False),
        ("driver", "peak_current", "current of a stalled motor", stalled, True),
        (
            "driver",
            "continuous_current",
            "continuous current",
            dc_motor.current(robot.motor, torque, "").value,
            True,
        ),
        ("driver", "logic_high_min", "input level without a level shifter", 2.97, False),
        ("battery", "continuous_current", "current", energy_budget.highest_draw(robot, mass).value, True),
        ("motor", "continuous_torque", "continuous torque", torque, True),
        ("motor", "length", "length", layout.motor_front(robot), False),
    ]
    for section, field, name, bound, at_least in bounds:
        changed = but(robot, **{section: {field: share * bound}})
        (check,) = [
            c for c in judge(changed, Load(mass, 0.0, 0.0, 0.2)) if (c.part, c.name) == (section, name)
        ]
        assert check.passed == (share == 1.0 or (share > 1.0) == at_least), name


def test_two_motors_fit_between_their_clamps() -> None:
    robot = but(
        CHEFBOT, wheels={"separation": 0.3, "width": 0.02, "gap": 0.002}, motor_clamp={"thickness": 0.003}
    )
    assert layout.motor_front(robot) == pytest.approx(0.15 - 0.01 - 0.002 - 0.003)


@given(robots)
def test_the_smallest_wheel_is_just_large_enough(robot: Robot) -> None:
    wheel = sizing.smallest_wheel(robot)
    wanted = robot.body.clearance
    assert layout.motor_bottom(but(robot, wheels={"diameter": wheel})) >= wanted - 1e-9
    assert layout.motor_bottom(but(robot, wheels={"diameter": wheel - 0.0011})) < wanted


# -- tipping


@given(st.floats(-0.05, 0.05), st.floats(-0.05, 0.05), st.floats(0.0, 2.0 * math.pi))
def test_mounting_clearance_ends_at_the_polygon_edge(x: float, y: float, angle: float) -> None:
    polygon = support(CHEFBOT)
    direction = (math.cos(angle), math.sin(angle))
    reach = room(polygon, (x, y), direction)
    end = (x + reach * direction[0], y + reach * direction[1])
    along, across = CHEFBOT.casters.offset, CHEFBOT.wheels.separation / 2.0
    assert abs(end[0]) / along + abs(end[1]) / across == pytest.approx(1.0)


@given(st.floats(0.1, 5.0), st.floats(0.05, 1.0), st.floats(0.5, 20.0))
def test_braking_tips_where_caster_moments_balance(a: float, height: float, mass: float) -> None:
    load = Load(mass, 0.0, 0.0, height)
    braking = tipping(but(CHEFBOT, drive={"max_slope": 0.0, "max_acceleration": a}), load)[1]
    overturning, righting = mass * a * height, mass * GRAVITY * CHEFBOT.casters.offset
    assert (braking.expected.value > braking.limit.value) == (overturning > righting)


@given(st.floats(0.05, 1.0), st.floats(0.001, 1.0))
def test_a_higher_load_is_never_more_stable(height: float, more: float) -> None:
    low, high = (tipping(CHEFBOT, Load(5.0, 0.0, 0.0, z)) for z in (height, height + more))
    assert all(b.limit.value < a.limit.value for a, b in zip(low, high, strict=True))


def test_the_payload_centre_is_half_its_height_above_the_top() -> None:
    own = robot_mass_properties(CHEFBOT)
    load, payload = loaded(CHEFBOT), CHEFBOT.body.payload
    top = body_height(CHEFBOT) + CHEFBOT.body.payload_height / 2.0
    assert load.mass == pytest.approx(own.mass + payload)
    assert load.mass * load.z == pytest.approx(own.mass * own.centre[2] + payload * top)
    assert load.mass * load.x == pytest.approx(own.mass * own.centre[0], abs=1e-12)


def test_a_centre_of_mass_beyond_the_wheels_tips_the_robot() -> None:
    assert tipping(CHEFBOT, Load(5.0, 0.5, 0.0, 0.2))[0].limit.value < 0.0
