"""The page of the vocabulary of faults: a table for each group of structs."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from chefbot.sim.faults.events import BoardFault, NodeFault, SensorFault, WheelFault
from generate.launches import Parameter, parameters_of
from generate.rst import anchor, code, escape, heading, table, write

GROUPS = {
    "Sensors": SensorFault,
    "Wheels": WheelFault,
    "Battery, board and clocks": BoardFault,
    "Nodes and links": NodeFault,
}
COMMON = ("at", "until")


def write_faults(path: Path) -> None:
    """Write the page from the structs of the faults."""
    intro = (
        "Every fault has `at`, the time at which it begins, and every fault that lasts may have `until`, both in"
        " seconds of simulated time. See :doc:`/faults`."
    )
    parts = [
        anchor("fault-events"),
        heading("Faults"),
        escape(intro.split(" See")[0]) + " See :doc:`/faults`.\n",
    ]
    for title, union in GROUPS.items():
        rows = list(_rows(union))
        parts += [
            heading(title, "-"),
            table(("fault", "what happens", "key", "value", "default", "meaning"), rows),
        ]
    write(path, parts)


def _rows(union: Any) -> Iterator[tuple[str, ...]]:
    for kind in get_args(union):
        tag, text = code(str(kind.__struct_config__.tag)), escape(inspect.getdoc(kind) or "")
        if "until" not in kind.__struct_fields__:
            text += " It is momentary and has no ``until``."
        keys = [one for one in parameters_of(kind) if one.name not in COMMON]
        for index, key in enumerate(keys or [None]):
            start = (tag, text) if index == 0 else ("", "")
            yield *start, *(_cells(key) if key is not None else ("", "", "", ""))


def _cells(key: Parameter) -> tuple[str, str, str, str]:
    value = code(" ".join(part for part in (key.type, key.bounds) if part))
    default = "required" if key.default == "required" else code(str(key.default))
    return code(key.name), value, default, escape(key.description)
