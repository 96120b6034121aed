"""No formula of the robot stands a second time: what several attributes of it give has one function."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.arch.formulas import Formula, copies, formulas, read

pytestmark = pytest.mark.slow
SOURCE = Path(__file__).parents[2] / "src" / "chefbot"
ON_PURPOSE = {"design/sizing/chapter_method.py"}
"""The book chapter's own calculation, with its own pi and gravity, is shown beside ours."""


@pytest.fixture(scope="module")
def source() -> tuple[Formula, ...]:
    """All formulas of the source."""
    files = [(path, text) for path, text in read(SOURCE) if path not in ON_PURPOSE]
    return tuple(formula for path, text in files for formula in formulas(text, path))


def test_no_formula_of_the_robot_stands_twice(source) -> None:
    assert len(source) > 50
    places = [f"{one.function}, line {one.line}: {one.text}" for one in copies(source)]
    assert not places, "one formula, several functions; give it one:\n" + "\n".join(places)


@pytest.mark.parametrize(
    ("home", "text"),
    [
        ("metres_per_tick", "math.pi * robot.wheels.diameter / robot.motor.ticks_per_turn * ticks"),
        ("metres_per_tick", "speed * robot.motor.ticks_per_turn / (2.0 * math.pi * robot.wheel_radius)"),
        ("no_load_tick_rate", "robot.motor.no_load_speed * robot.motor.ticks_per_turn / math.tau"),
        ("outer_face", "max(0.1, (robot.wheels.separation + robot.wheels.width) / 2)"),
        ("wheel_corner_radius", "math.hypot(robot.wheel_radius, robot.wheels.outer_face)"),
        (
            "rolling_torque",
            "0.5 * GRAVITY * self.robot.wheel_radius * total_mass(self.robot) * ROLLING_RESISTANCE",
        ),
        ("max_speed", "min(max_wheel_speed(robot), robot.drive.max_speed) / 2"),
        ("traction", "mass * robot.wheels.friction * DRIVEN_WEIGHT_FRACTION"),
    ],
)
def test_a_copy_would_be_found(source, home: str, text: str) -> None:
    """Also behind local names, in another order and with other numbers."""
    in_one = f"def copied(self, robot, ticks, speed, mass):\n    return {text}\n"
    wheels = text.replace("robot.wheels.", "wheels.")
    by_name = f"def named(self, robot: Robot, ticks, speed, mass):\n    wheels = robot.wheels\n    return {wheels}\n"
    for copy in (in_one, by_name):
        functions = {one.function for one in copies([*source, *formulas(copy, "copy.py")])}
        assert len(functions) == 2
        assert any(function.endswith(home) for function in functions)
        assert any(function.startswith("copy.py") for function in functions)


@pytest.mark.parametrize(
    "text",
    [
        "robot.metres_per_tick * ticks",
        "robot.wheels.diameter * robot.wheels.width / robot.plates.thickness",
        "speed / robot.wheels.separation",
    ],
)
def test_the_use_of_a_formula_is_not_a_copy(source, text: str) -> None:
    used = formulas(f"def use(robot, ticks, speed):\n    return {text}\n", "use.py")
    assert copies([*source, *used]) == []
