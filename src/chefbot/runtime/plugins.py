"""Plugins named in launch files, such as a third-party planner, controller or costmap layer."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from chefbot.errors import UserError


def load_plugin(name: str, built_in: Callable[[Any], Any], settings: Any) -> Any:
    """Create a plugin from `pkg.module:Class` or the name of an entry point.

    An empty name means `built_in`.
    """
    return (built_in if not name else _find(name))(settings)


def _find(name: str) -> type:
    entry_point_values = {point.name: point.value for point in entry_points(group="chefbot.plugins")}
    module, _, attribute = entry_point_values.get(name, name).partition(":")
    try:
        plugin_class = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, TypeError, ValueError) as error:  # TypeError: a relative name
        raise UserError(
            f"plugin {name!r} cannot be imported: {error}; write it as pkg.module:Class"
        ) from None
    if not isinstance(plugin_class, type):
        raise UserError(f"plugin {name!r} is not a class")
    return plugin_class
