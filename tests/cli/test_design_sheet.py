"""The design sheet as data and as tables, built from a few sets of parts."""

from __future__ import annotations

import io
import json
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from chefbot.cli.robot.design import work_out
from chefbot.cli.robot.design_json import as_plain
from chefbot.cli.robot.design_print import MAX_REASONS, print_sheet, reason, reasons, requirements
from chefbot.cli.robot.units import amount
from chefbot.design.sizing.component_selection import Verdict
from chefbot.design.sizing.design_sheet import Sheet
from chefbot.design.sizing.requirements import Check, at_least, at_most
from chefbot.robot.load import find_robot


@cache
def sheet(payload: str = "") -> Sheet:
    return work_out(find_robot("chefbot"), {"payload": payload} if payload else {})[1]


def shown(one: Sheet) -> str:
    console = Console(file=io.StringIO(), width=100, highlight=False)
    print_sheet(console, one)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def failing(one: Sheet, *checks: Check) -> Verdict:
    return one.chosen._replace(checks=list(checks))


TORQUE = at_least("motor", "continuous torque", 0.18, 0.4, "N m")
LONG = at_most("motor", "length", 0.12, 0.1, "m", "wheels.separation")
VOLTS = at_most("driver", "highest voltage", 14.6, 14.0, "V")


def test_a_reason_has_both_figures_and_the_key_to_change() -> None:
    assert (
        reason(TORQUE)
        == "motor: continuous torque 0.18 N m (1.84 kg cm), at least 0.4 N m (4.08 kg cm) required"
    )
    assert reason(LONG) == "motor: length 120 mm, at most 100 mm required; change wheels.separation"


def test_figures_that_look_equal_get_more_digits() -> None:
    assert "14.001 V, at most 14 V" in reason(at_most("driver", "voltage", 14.001, 14.0, "V"))


def test_the_reasons_of_a_part_are_its_own_the_worst_first() -> None:
    verdict = failing(sheet(), VOLTS, TORQUE, LONG)
    assert reasons(verdict, "motor") == [reason(TORQUE), reason(LONG)]
    assert reasons(verdict, "driver") == [reason(VOLTS)]
    assert reasons(verdict, "battery") == [reason(TORQUE), reason(LONG), reason(VOLTS)], (
        "those of the other parts"
    )
    assert reasons(failing(sheet())) == []


@given(st.integers(0, 9))
def test_only_the_worst_reasons_are_listed(count: int) -> None:
    checks = [at_least("motor", f"figure {i}", 1.0, 2.0 + i, "V") for i in range(count)]
    lines = reasons(failing(sheet(), *checks))
    assert len(lines) == min(count, MAX_REASONS + 1)
    if count > MAX_REASONS:
        assert f"figure {count - 1}" in lines[0] and lines[-1] == f"and {count - MAX_REASONS} more"


def test_the_requirements_are_those_of_the_robot() -> None:
    robot = sheet().robot
    assert requirements(sheet()) == (
        f"{robot.body.payload:.3g} kg at {robot.drive.max_speed:.3g} m/s, acceleration "
        f"{robot.drive.max_acceleration:.3g} m/s^2, ramps of {amount(robot.drive.max_slope, 'rad')}, "
        f"{robot.power.run_time / 3600.0:.3g} h from one charge, wheels of {1000 * robot.wheels.diameter:.3g} mm"
    )


def test_a_design_that_passes_names_the_selected_parts() -> None:
    one = sheet()
    out, data = shown(one), as_plain(one)
    assert f"Selected (*): {', '.join(one.chosen.parts)}" in out
    assert all(f"{name} *" in out for name in one.chosen.parts)
    assert data["choice"]["parts"] == one.chosen.parts._asdict() and data["nearest"] is None
    assert data["choice"]["passes"] and data["choice"]["failures"] == []


def test_a_design_that_fails_names_the_nearest_parts_and_why() -> None:
    one = sheet("60 kg")
    assert not one.chosen.passed, "nothing in the catalogue moves that"
    out, data = shown(one), as_plain(one)
    assert "No set of parts in the catalogue passes. The nearest is" in out and "Selected" not in out
    assert " *" not in out.split("Motors of the catalogue")[1].split("No set")[0]
    assert data["choice"] is None and data["nearest"]["parts"] == one.chosen.parts._asdict()
    lacks = [check["lack"] for check in data["nearest"]["failures"]]
    assert lacks == sorted(lacks, reverse=True) and min(lacks) > 0.0


def test_the_data_is_strict_json_with_the_whole_catalogue() -> None:
    one = sheet()
    data = json.loads(json.dumps(as_plain(one), allow_nan=False))
    assert data["robot"] == "chefbot" and data["asked_for"] == {}
    for part in ("motor", "driver", "battery"):
        assert set(data["catalogue"][part]) == {getattr(verdict.parts, part) for verdict in one.candidates}
        assert all(found["parts"][part] == name for name, found in data["catalogue"][part].items())


@pytest.mark.parametrize(
    ("value", "text"),
    [(999.4, "999 V"), (999.6, "1000 V"), (-999.6, "-1000 V"), (1234.4, "1234 V"), (0.0, "0 V")],
)
def test_an_amount_has_no_exponent_at_a_thousand(value: float, text: str) -> None:
    assert amount(value, "V") == text
