"""The page of scenario files: their keys, tasks and figures, and the built-in scenarios."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from chefbot.proving.figures import FIGURES
from chefbot.proving.scenario import Scenario, built_in_scenarios, load_scenario
from chefbot.proving.scenario_tasks import TASKS, Bounds, task_name
from generate.launches import parameters_of
from generate.rst import anchor, code, escape, heading, table, write

KEYS = ("key", "value", "default", "meaning")
BETTER = {1: "more", -1: "less", 0: "neither"}


def write_scenarios(path: Path) -> None:
    """Write the page from the structs, the figures and the scenario files."""
    parts = [anchor("scenarios"), heading("Scenarios"), "See :doc:`/proving`.\n"]
    for title, kind in (
        ("Scenario file", Scenario),
        ("Bounds of a criterion", Bounds),
    ):
        parts += [heading(title, "-"), table(KEYS, _keys(kind))]
    for task in TASKS:
        parts += [heading(f"Task {task_name(task)}", "-"), escape(inspect.getdoc(task) or "") + "\n"]
        if msgspec.structs.fields(task):
            parts.append(table(KEYS, _keys(task)))
    figures = ((code(n), escape(f.unit), BETTER[f.better], escape(f.meaning)) for n, f in FIGURES.items())
    parts += [heading("Figures", "-"), table(("figure", "unit", "better", "meaning"), figures)]
    built_in = map(load_scenario, built_in_scenarios())
    rows = ((code(one.name), escape(one.robot_name), escape(one.description)) for one in built_in)
    parts += [heading("Built-in scenarios", "-"), table(("scenario", "robot", "what it shows"), rows)]
    write(path, parts)


def _keys(kind: Any) -> Iterator[tuple[str, ...]]:
    for key in parameters_of(kind):
        value = code(" ".join(part for part in (key.type, key.bounds) if part))
        default = "required" if key.default == "required" else code(str(key.default))
        yield code(key.name), value, default, escape(key.description)
