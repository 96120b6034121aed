"""The design sheet as plain data in SI units."""

from __future__ import annotations

from typing import Any

from chefbot.design.sizing.calculation import Result
from chefbot.design.sizing.component_selection import CRITERION, Verdict, best_with
from chefbot.design.sizing.dependent_dimensions import moved_sensors
from chefbot.design.sizing.design_sheet import Sheet
from chefbot.design.sizing.requirements import Check
from chefbot.design.sizing.sizing import component_results, drive_requirements, stability_results


def as_plain(sheet: Sheet) -> dict[str, Any]:
    """Return methods, catalogue and selection; every value with formula, numbers, unit and source."""
    robot, load = sheet.chosen.robot, sheet.chosen.load
    follows = [*sheet.follows, *moved_sensors(sheet.robot, robot)]
    return {
        "robot": sheet.name,
        "asked_for": sheet.given,
        "follows": {".".join(change.path): change.text for change in follows},
        "own_failures": [_check(check) for check in sheet.own if not check.passed],
        "chapter": [_result(result) for result in sheet.chapter],
        "needs": [_result(result) for result in drive_requirements(robot, load)],
        "gives": [_result(result) for result in component_results(robot, load)],
        "stands": [_result(result) for result in stability_results(robot, load)],
        "catalogue": {part: _catalogue(sheet, part) for part in ("motor", "driver", "battery")},
        "criterion": CRITERION,
        "choice": _verdict(sheet.chosen) if sheet.chosen.passed else None,
        "nearest": None if sheet.chosen.passed else _verdict(sheet.chosen),
    }


def _result(result: Result) -> dict[str, Any]:
    return {
        "name": result.name,
        "value": result.value,
        "unit": result.unit,
        "formula": result.formula,
        "numbers": result.numbers,
        "symbols": result.symbols,
        "source": result.source,
    }


def _catalogue(sheet: Sheet, part: str) -> dict[str, Any]:
    names = dict.fromkeys(getattr(verdict.parts, part) for verdict in sheet.candidates)
    return {name: _verdict(best_with(sheet.candidates, part, name)) for name in names}


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {
        "parts": verdict.parts._asdict(),
        "passes": verdict.passed,
        "mass": verdict.mass,
        "power": verdict.power,
        "failures": [_check(check) for check in verdict.failures],
    }


def _check(check: Check) -> dict[str, Any]:
    return {**check._asdict(), "lack": check.lack}
