"""Classes named in launch files: a planner, a controller, a layer of somebody else's."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from chefbot.errors import UserError


def plugin(name: str, built_in: Callable[[Any], Any], settings: Any) -> Any:
    """An instance of `pkg.module:Class` or of the entry point so called; of `built_in` where name is empty."""
    return (built_in if not name else _find(name))(settings)


def _find(name: str) -> type:
    points = {point.name: point.value for point in entry_points(group="chefbot.plugins")}
    module, _, attribute = points.get(name, name).partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f"plugin {name!r} cannot be imported: {error}; write it as pkg.module:Class"
        ) from None
    if not isinstance(found, type):
        raise UserError(f"plugin {name!r} is not a class")
    return found
