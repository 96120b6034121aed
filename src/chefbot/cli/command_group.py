"""Command groups whose errors are one sentence with the nearest name, as all other errors of bad input."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from typing import Any, cast

import typer
from typer.core import TyperGroup

from chefbot.errors import UserError, name_hint

UsageError = cast(type[Exception], typer.BadParameter.__base__)
"""Base class of the errors in options and arguments; Typer does not export it under a name of its own."""
LIBRARY_PHRASES = {
    r"Value error, ": "",
    r"is not one of '', ": "is not one of ",
    r"Input should be greater than or equal to": "must be at least",
    r"Input should be less than or equal to": "must be at most",
    r"Input should be greater than": "must be more than",
    r"Input should be less than": "must be less than",
    r"Input should be a valid integer.*": "must be a whole number",
    r"Input should be a valid number.*": "must be a number",
}
"""Phrases of the libraries that check options, as patterns, and what they mean to a person at a terminal."""
HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}


class CommandGroup(TyperGroup):
    """Group of commands that prints its help without arguments and suggests a command for an unknown one."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the group's options; without arguments, print the help and exit with code 0."""
        if not args and self.no_args_is_help and not ctx.resilient_parsing:
            typer.echo(ctx.get_help())
            ctx.exit()
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command. Raises UserError with the nearest one if it is unknown."""
        name = args[0]
        if not ctx.resilient_parsing and not name.startswith("-") and self.get_command(ctx, name) is None:
            path = ctx.command_path
            raise UserError(f"`{path}` has no command {name!r}{suggestion(self, name, path)}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command; an error of an option without its value gets the command, which its parser leaves out."""
        try:
            return super().invoke(ctx)
        except UsageError as error:
            name = ctx.invoked_subcommand
            if getattr(error, "ctx", None) is None and name in self.commands:
                error.ctx = type(ctx)(self.commands[name], parent=ctx, info_name=name)  # type: ignore[attr-defined]
            raise


def suggestion(group: TyperGroup, name: str, path: str) -> str:
    """Return a hint at the nearest command of the group or of its subgroups, else how to list all."""
    lines = list(_command_lines(group))
    by_name: dict[str, str] = {}
    for line, _ in lines:
        by_name.setdefault(line.rpartition(" ")[2], line)
        by_name.setdefault(line.replace(" ", "_"), line)
    nearest = (
        by_name.get(name)
        or "".join(difflib.get_close_matches(name, group.commands, n=1))
        or _nearest(name, by_name, cutoff=0.8)
        or _described_by(name, lines)
        or _nearest(name, by_name, cutoff=0.6)
    )
    return f" (did you mean `{path} {nearest}`?)" if nearest else f"; `{path} --help` lists all commands"


def _nearest(name: str, by_name: dict[str, str], cutoff: float) -> str:
    """Return the command line with the nearest name, "" if none is near."""
    return next((by_name[near] for near in difflib.get_close_matches(name, by_name, n=1, cutoff=cutoff)), "")


def _described_by(name: str, lines: list[tuple[str, str]]) -> str:
    """Return the command line whose help contains a word with this beginning, "" if none does.

    Groups are searched before their commands; of a group that matches, a command that matches too is returned.
    """
    word = re.compile(rf"(?<![a-z]){re.escape(name)}", re.IGNORECASE)
    found = [line for line, text in lines if len(name) > 2 and word.search(text)]
    first = min(found, key=lambda line: line.count(" "), default="")
    return next((line for line in found if line.startswith(f"{first} ")), first)


def _command_lines(group: TyperGroup) -> Iterator[tuple[str, str]]:
    """Yield the commands of the group and of its subgroups as they are typed, each with its help."""
    for name, command in group.commands.items():
        yield name, command.help or ""
        if isinstance(command, TyperGroup):
            yield from ((f"{name} {line}", text) for line, text in _command_lines(command))


def explain_usage_error(error: Any) -> str:
    """Return one sentence for an error in options or arguments, with the command and the nearest option."""
    path = error.ctx.command_path if error.ctx is not None else "chefbot"
    if not hasattr(error, "possibilities"):  # all errors but that of an unknown option
        sentence = _without_library_phrases(error.format_message().rstrip("."))
        return f"`{path}`: {sentence[:1].lower()}{sentence[1:]}; see `{path} --help`"
    if error.option_name.lstrip("-")[:1].isdigit():
        hint = "write `--` before negative numbers, after all options"
        return f"`{path}`: {error.option_name} is not an option; {hint}"
    options = [text for parameter in error.ctx.command.params for text in parameter.opts if text[:1] == "-"]
    return f"`{path}` has no option {error.option_name}{name_hint(error.option_name, [*options, '--help'])}"


def _without_library_phrases(sentence: str) -> str:
    for pattern, phrase in LIBRARY_PHRASES.items():
        sentence = re.sub(pattern, phrase, sentence)
    return sentence


def new_group(help_text: str, **settings: Any) -> typer.Typer:
    """Return a Typer application for a group of commands."""
    settings = {"cls": CommandGroup, "no_args_is_help": True, **settings}
    return typer.Typer(help=help_text, context_settings=HELP_OPTIONS, **settings)
