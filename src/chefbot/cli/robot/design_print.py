"""The design sheet as tables in a terminal."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table

from chefbot.cli.robot.units import amount, amounts
from chefbot.design.sizing.calculation import Result
from chefbot.design.sizing.chapter_method import KG_CM
from chefbot.design.sizing.component_selection import CRITERION, Verdict, best_with
from chefbot.design.sizing.dependent_dimensions import moved_sensors
from chefbot.design.sizing.design_sheet import Sheet
from chefbot.design.sizing.forces import motor_torque, slip_torque, worst
from chefbot.design.sizing.requirements import Check
from chefbot.design.sizing.sizing import component_results, drive_requirements, stability_results
from chefbot.design.sizing.stability import SAFETY

MAX_REASONS = 3
"""Maximum number of failed checks shown for one part."""
PARTS = {"motor": "Motors", "driver": "Drivers", "battery": "Batteries"}


def print_sheet(console: Console, sheet: Sheet) -> None:
    """Print both methods side by side, all calculations, the catalogue and the selection."""
    console.print(f"[bold]{sheet.name}[/]: {requirements(sheet)}\n")
    console.print(_side_by_side(sheet))
    for title, results in _calculations(sheet):
        console.print(_workings(title, results))
    for part, title in PARTS.items():
        console.print(_catalogue(title, part, sheet))
    _print_choice(console, sheet)


def _calculations(sheet: Sheet) -> Iterator[tuple[str, list[Result]]]:
    """Yield the calculations of the sheet with their titles."""
    robot, load, parts = sheet.chosen.robot, sheet.chosen.load, sheet.chosen.parts
    yield "The chapter's method", sheet.chapter
    yield f"Corrected method: requirements with {parts.motor}", drive_requirements(robot, load)
    yield f"Performance of {', '.join(parts)}", component_results(robot, load)
    yield f"Clearance and tipping (with a safety factor of {SAFETY:g})", stability_results(robot, load)


def requirements(sheet: Sheet) -> str:
    """Return the requirements of the robot as a sentence."""
    robot = sheet.robot
    return (
        f"{amount(robot.body.payload, 'kg')} at {amount(robot.drive.max_speed, 'm/s')}, "
        f"acceleration {amount(robot.drive.max_acceleration, 'm/s^2')}, "
        f"ramps of {amount(robot.drive.max_slope, 'rad')}, {amount(robot.power.run_time, 's')} from one charge, "
        f"wheels of {amount(robot.wheels.diameter, 'm')}"
    )


def _side_by_side(sheet: Sheet) -> Table:
    """Return a table of the values that both methods calculate."""
    table = _table("Both methods", "", "chapter", "corrected", "why they differ")
    for row in _rows_of_both(sheet):
        table.add_row(*row)
    return table


def _rows_of_both(sheet: Sheet) -> list[tuple[str, str, str, str]]:
    robot, load = sheet.chosen.robot, sheet.chosen.load
    chapter = {result.name: result for result in sheet.chapter}
    corrected = {result.name: result for result in drive_requirements(robot, load)}
    hardest = motor_torque(robot, load.mass, worst(robot)).value
    speed = corrected["speed of the wheels, with reserve"]
    bought = chapter["torque to look for"]
    return [
        ("mass with payload", _mass_of_chapter(sheet), amount(load.mass, "kg"), "estimate; mass of the solids"),
        (
            "torque of a motor", _shown(chapter["torque of each motor"]), amount(hardest, "N m"),
            "slipping tyre with the load of both wheels; forces on ramp and carpet, drive losses",
        ),
        ("tyre slips at", "", _shown(slip_torque(robot, load.mass)), "half the weight on two driven wheels"),
        ("speed of the wheels", _shown(chapter["speed"]), _shown(speed), "no reserve; a fifth above, under load"),
        (
            "to be bought", f"{_shown(bought)} at {_shown(chapter['speed to look for'])}",
            f"{sheet.chosen.parts.motor}", "stall torque; torque-speed line, heat, voltage, current, space",
        ),
    ]  # fmt: skip


def _mass_of_chapter(sheet: Sheet) -> str:
    body = sheet.robot.body
    return amount(body.mass_budget + body.payload, "kg")


def _workings(title: str, results: list[Result]) -> Table:
    """Return a table of values with formula, numbers, and the source where it changes."""
    table = _table(title, "quantity", "calculation", "result")
    source = ""
    for result in results:
        lines = [result.formula]
        if result.numbers != result.formula:
            lines.append(f"= {result.numbers}")
        if result.source != source:
            lines.append(f"[dim]from: {result.source}[/]")
        source = result.source
        table.add_row(result.name, "\n".join(lines), _shown(result))
    return table


def _shown(result: Result) -> str:
    if result.name == "torque of each motor":
        return f"{result.value:.4g} N m ({result.value / KG_CM:.2f} kg cm)"
    return amount(result.value, result.unit)


def _catalogue(title: str, part: str, sheet: Sheet) -> Table:
    """Return a table of the components: whether each passes with the best others, and if not, why."""
    table = _table(f"{title} of the catalogue", "", "passes", "why not, with the best other parts")
    names = list(dict.fromkeys(getattr(verdict.parts, part) for verdict in sheet.candidates))
    for name in names:
        best = best_with(sheet.candidates, part, name)
        mark = "[green]yes[/]" if best.passed else "[red]no[/]"
        picked = sheet.chosen.passed and getattr(sheet.chosen.parts, part) == name
        table.add_row(f"[bold]{name}[/] *" if picked else name, mark, "\n".join(reasons(best, part)))
    return table


def reasons(verdict: Verdict, part: str = "") -> list[str]:
    """Return a phrase for each of the MAX_REASONS worst failed checks, of the part if it has any."""
    failures = [check for check in verdict.failures if check.part == part] or verdict.failures
    more = len(failures) - MAX_REASONS
    return [reason(check) for check in failures[:MAX_REASONS]] + ([f"and {more} more"] if more > 0 else [])


def reason(check: Check) -> str:
    """Return a phrase: `motor: continuous torque 0.18 N m (1.8 kg cm), at least 0.4 N m (4 kg cm) required`."""
    bound = "at least" if check.at_least else "at most"
    have, need = amounts(check.have, check.bound, check.unit)
    change = "" if check.key == check.part else f"; change {check.key}"
    return f"{check.part}: {check.name} {have}, {bound} {need} required{change}"


def _print_choice(console: Console, sheet: Sheet) -> None:
    failing = [check for check in sheet.own if not check.passed]
    console.print(f"The parts in the file {'pass' if not failing else 'do not pass'}.")
    for check in failing:
        console.print(f"  {reason(check)}")
    for change in [*sheet.follows, *moved_sensors(sheet.robot, sheet.chosen.robot)]:
        console.print(f"Dependent change: {'.'.join(change.path)} becomes {change.text}: {change.comment}.")
    chosen = sheet.chosen
    parts = f"{chosen.parts.motor}, {chosen.parts.driver}, {chosen.parts.battery}"
    if chosen.passed:
        console.print(f"[bold green]Selected (*)[/]: {parts}: {chosen.mass:.2f} kg, {chosen.power:.1f} W.")
        console.print(CRITERION)
        return
    console.print(
        f"[bold red]No set of parts in the catalogue passes.[/] The nearest is {parts}; it fails at:"
    )
    for line in reasons(chosen):
        console.print(f"  {line}")


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", expand=False, show_lines=False)
    for column in columns:
        table.add_column(column, overflow="fold")
    return table
