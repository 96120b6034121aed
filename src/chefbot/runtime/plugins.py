"""Plugins named in launch files, such as a third-party planner, controller or costmap layer."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.metadata import entry_points
from types import ModuleType
from typing import Any

from chefbot.errors import UserError


def load_plugin(name: str, built_in: Callable[[Any], Any], settings: Any, interface: type) -> Any:
    """Create a plugin from `pkg.module:Class` or the name of an entry point.

    An empty name means `built_in`. interface: the class that declares the methods of such a plugin. Raises UserError
    for a plugin that does not exist or lacks a method.
    """
    if not name:
        return built_in(settings)
    plugin_class = _find(name)
    for method, declared in vars(interface).items():
        is_required = callable(declared) and not method.startswith("_")
        if is_required and not callable(getattr(plugin_class, method, None)):
            raise UserError(
                f"plugin {name!r} has no method {method!r}; it needs all methods of "
                f"{interface.__module__}:{interface.__name__}"
            )
    return plugin_class(settings)


def class_path(name: str, group: str) -> tuple[str, str]:
    """Return module and class of `pkg.module:Class`, or of an entry point in a group of entry points."""
    if ":" not in name:  # searched for such names only: it reads a file of every installed package
        name = next((point.value for point in entry_points(group=group) if point.name == name), name)
    module, _, attribute = name.partition(":")
    return module, attribute


def _find(name: str) -> type:
    module, attribute = class_path(name, "chefbot.plugins")
    try:
        plugin_class = getattr(_imported(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f"plugin {name!r} cannot be imported: {error}; write it as pkg.module:Class"
        ) from None
    if not isinstance(plugin_class, type):
        raise UserError(f"plugin {name!r} is not a class")
    return plugin_class


def _imported(module: str) -> ModuleType:
    if module.startswith("."):  # importlib raises a TypeError, as does a plugin with a fault of its own
        raise ImportError("a launch file has no package that a relative name could start from")
    return importlib.import_module(module)
