"""`chefbot robot design` as a person runs it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.waiting import PATIENCE

from chefbot.cli.robot.design import run_design, work_out
from chefbot.cli.robot.units import SHOWN, amount
from chefbot.design.sizing.requirements import judge
from chefbot.design.sizing.stability import loaded
from chefbot.errors import UserError
from chefbot.maths.units import to_si
from chefbot.robot.load import find_robot, load_robot
from chefbot.robot.motion_limits import max_speed

NOTHING: dict[str, str | None] = {}


def printed(capsys: pytest.CaptureFixture[str], *, as_json: bool = False, **requirements: str) -> str:
    run_design(
        "chefbot", {name.replace("_", "-"): value for name, value in requirements.items()}, None, as_json
    )
    return capsys.readouterr().out


def test_the_sheet_shows_both_methods_within_100_columns(capsys: pytest.CaptureFixture[str]) -> None:
    out = printed(capsys)
    for phrase in ("0.6 * 25 * 0.045", "0.675 N m (6.88 kg cm)", "10 kg cm", "74.3 rpm", "80 rpm", "50 N"):
        assert phrase in out, phrase
    for phrase in ("m * (a + g * sin(s) + c * g *", "pololu_37d_131", "Selected (*)", "lowest power"):
        assert phrase in out, phrase
    assert max(len(line) for line in out.splitlines()) <= 100


def test_json_contains_every_figure_with_its_calculation(capsys: pytest.CaptureFixture[str]) -> None:
    sheet = json.loads(printed(capsys, as_json=True, payload="3 kg"))
    assert sheet["asked_for"] == {"payload": "3 kg"}
    for part in ("chapter", "needs", "gives", "stands"):
        assert all(entry["formula"] and entry["numbers"] and entry["source"] for entry in sheet[part])
        assert all(
            set(entry["symbols"]) <= set(re.findall(r"\w+", entry["formula"])) for entry in sheet[part]
        )
    assert sheet["chapter"][2]["symbols"] == {"mu": 0.6, "N": 30.0, "r": 0.045}
    assert sheet["choice"]["passes"]
    slow = sheet["catalogue"]["motor"]["pololu_37d_131"]
    assert not slow["passes"]
    assert slow["failures"][0]["name"] == "speed with reserve"


@pytest.mark.slow
def test_a_heavier_robot_gets_a_file_that_passes_its_checks(tmp_path: Path) -> None:
    path = tmp_path / "big.yaml"
    run_design("chefbot", {"payload": "6", "speed": "0.6", "slope": None}, path, as_json=True)
    robot = load_robot(str(path))
    assert robot.name == "big"
    assert robot.body.payload == 6.0
    assert robot.drive.max_speed == 0.6
    assert max_speed(robot) == 0.6
    assert all(check.passed for check in judge(robot, loaded(robot)))
    text = path.read_text()
    assert "--payload 6 --speed 0.6" in text
    assert text.count("#") > 10, "the comments stay"
    again, sheet = work_out(path, {})
    assert again == text
    assert not sheet.follows
    assert all(check.passed for check in sheet.own)


@pytest.mark.parametrize("name", ["chefbot", "chefbot_lidar"])
def test_written_file_describes_the_evaluated_robot(tmp_path: Path, name: str) -> None:
    path = tmp_path / "judged.yaml"
    run_design(name, {"payload": "4"}, path, as_json=True)
    judged = work_out(find_robot(name), {"payload": "4"})[1].chosen.robot
    written = numbers(msgspec.to_builtins(load_robot(str(path))))
    assert written == pytest.approx(numbers(msgspec.to_builtins(judged)), abs=1e-9)


def numbers(value: object, path: str = "") -> dict[str, float]:
    """Every number of nested data, by its path."""
    if isinstance(value, dict):
        return {k: v for key, part in value.items() for k, v in numbers(part, f"{path}.{key}").items()}
    if isinstance(value, (list, tuple)):
        return {k: v for i, part in enumerate(value) for k, v in numbers(part, f"{path}[{i}]").items()}
    return {path: value} if isinstance(value, (int, float)) else {}


@pytest.mark.slow
def test_a_robot_that_extends_a_relative_file_may_be_moved(tmp_path: Path) -> None:
    run_design("chefbot", NOTHING, tmp_path / "first.yaml", as_json=True)
    (tmp_path / "second.yaml").write_text("like: first.yaml\nname: second\nbody: {payload: 1 kg}\n")
    path = tmp_path / "elsewhere" / "third.yaml"
    run_design(str(tmp_path / "second.yaml"), {"speed": "0.3"}, path, as_json=True)
    third = load_robot(str(path))
    assert (third.body.payload, third.drive.max_speed) == (1.0, 0.3)


@pytest.mark.slow
def test_other_wheels_change_their_slots(tmp_path: Path) -> None:
    path = tmp_path / "wheels.yaml"
    run_design("chefbot", {"wheel": "15 cm", "payload": "6 kg", "speed": "0.6 m/s"}, path, as_json=True)
    robot = load_robot(str(path))
    assert robot.wheels.diameter == pytest.approx(0.15)
    assert robot.plates.notch is not None
    assert robot.plates.notch.length > robot.wheels.diameter


@pytest.mark.slow
def test_units_may_be_given_or_left_out() -> None:
    path = find_robot("chefbot")
    pairs = [
        ("payload", "2.5", "2500 g"),
        ("speed", "0.4", "40 cm/s"),
        ("slope", "4", "0.0698131700797 rad"),
        ("run-time", "1.5", "90 min"),
    ]
    for name, bare, full in pairs:
        section, field = {"payload": ("body", "payload"), "speed": ("drive", "max_speed")}.get(
            name, {"slope": ("drive", "max_slope"), "run-time": ("power", "run_time")}.get(name, ("", ""))
        )
        values = [
            getattr(getattr(work_out(path, {name: text})[1].robot, section), field) for text in (bare, full)
        ]
        assert values[0] == pytest.approx(values[1], rel=1e-6)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("payload", "banana", "--payload"),
        ("payload", "3 m", "--payload"),
        ("payload", "-1", "payload"),
        ("speed", "nan", "--speed"),
        ("speed", "1e300", "max_speed"),
        ("slope", "89", "max_slope"),
        ("wheel", "0", "diameter"),
        ("run-time", "", "--run-time"),
    ],
)
def test_inconsistent_requirements_are_refused_with_the_reason(name: str, value: str, expected: str) -> None:
    with pytest.raises(UserError, match=expected) as caught:
        run_design("chefbot", {name: value}, None, as_json=True)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_nothing_is_written_if_no_design_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "truck.yaml"
    requirements: dict[str, str | None] = {"payload": "80", "speed": "3"}
    run_design("chefbot", requirements, None, as_json=False)
    assert "No set of parts in the catalogue passes" in capsys.readouterr().out
    with pytest.raises(UserError, match=r"not written.*nearest"):
        run_design("chefbot", requirements, path, as_json=False)
    assert not path.exists()


@pytest.mark.slow
def test_bad_input_exits_with_code_2_and_one_sentence() -> None:
    command = [
        sys.executable,
        "-c",
        "from chefbot.cli.app import main; main()",
        "robot",
        "design",
        "--payload",
        "tea",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("chefbot: --payload: ")
    assert done.stderr.count("\n") == 1


@given(st.sampled_from(sorted(SHOWN)), st.floats(1e-3, 1e5))
def test_a_printed_amount_parses_back_to_its_value(unit: str, value: float) -> None:
    text = amount(value, unit)
    shown = text.split("(")[0].strip()
    assert to_si(shown, unit) == pytest.approx(value, rel=6e-3)
    if "(" in text:
        assert to_si(text.split("(")[1].rstrip(")"), unit) == pytest.approx(value, rel=6e-3)
