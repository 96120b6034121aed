"""The page of the command line: every verb of `chefbot` with its help, arguments and options."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer.main

from chefbot.cli.app import app
from generate.rst import anchor, code, docstring, escape, heading, table, write


def write_commands(path: Path) -> None:
    """Write the page from the typer app."""
    group: Any = typer.main.get_command(app)
    parts = [anchor("command-line"), heading("Command line"), docstring(group.help or "")]
    for words, command in _verbs(group, ("chefbot",)):
        parts += [heading(" ".join(words), "-" if len(words) == 2 else "~"), docstring(command.help or "")]
        if not hasattr(command, "commands"):
            parts += [".. code-block:: sh\n", f"   {_usage(words, command)}\n"]
        rows = [_row(parameter) for parameter in command.params if not parameter.hidden]
        if rows:
            parts.append(table(("argument", "value", "default", "meaning"), rows))
    write(path, parts)


def _verbs(command: Any, words: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield each group and verb below `command` with the words that name it."""
    for name, verb in sorted(getattr(command, "commands", {}).items()):
        if not verb.hidden:
            yield (*words, name), verb
            yield from _verbs(verb, (*words, name))


def _usage(words: tuple[str, ...], command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    shown = [f"[{p.name.upper()}]" if not p.required else p.name.upper() for p in arguments]
    options = ["[OPTIONS]"] if len(arguments) < len(command.params) else []
    return " ".join([*words, *options, *shown])


def _row(parameter: Any) -> tuple[str, str, str, str]:
    if parameter.param_type_name == "argument":
        name = parameter.name.upper()
    else:
        name = ", ".join([*parameter.opts, *parameter.secondary_opts])
    default = "required" if parameter.required else _default(parameter.default)
    return code(name), code(_type(parameter)), default, escape(getattr(parameter, "help", None) or "")


def _default(value: Any) -> str:
    if value is None or value == "" or value is False or callable(value):
        return ""
    return code(str(value))


def _type(parameter: Any) -> str:
    """Return the parameter's Python type with its bounds."""
    if getattr(parameter, "is_flag", False):
        return ""
    annotation = parameter.type_descriptor.annotation
    name = getattr(annotation, "__name__", "") if not getattr(annotation, "__args__", ()) else ""
    text = name or str(annotation).replace("typing.", "")
    bounds = [
        f"{sign} {value}"
        for sign, value in ((">=", parameter.min), ("<=", parameter.max))
        if value is not None
    ]
    return " ".join([text, *bounds])
