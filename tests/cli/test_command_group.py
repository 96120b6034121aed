"""The nearest command for an unknown one, and one sentence for wrong options."""

from __future__ import annotations

from typing import Annotated, cast

import pytest
import typer
import typer.main
from hypothesis import given
from hypothesis import strategies as st
from typer.core import TyperGroup

from chefbot.cli.app import app
from chefbot.cli.command_group import UsageError, explain_usage_error, new_group, suggestion
from chefbot.errors import UserError


def small_app() -> typer.Typer:
    """`x fleet sign FILE`, `x fleet init`, `x map save --size N` and `x order`."""
    fleet, maps, root = new_group("Keys and certificates."), new_group("Maps."), new_group("A tool.")

    @fleet.command("sign")
    def sign(file: str) -> None:
        """Sign a request."""

    @fleet.command("init")
    def init() -> None:
        """Create a fleet."""

    @maps.command("save")
    def save(size: Annotated[int, typer.Option(min=1)] = 1) -> None:
        """Save the map, as map_saver does."""

    @maps.command("compare")
    def compare() -> None:
        """Compare two of them."""

    @root.command("order")
    def order() -> None:
        """Order food."""

    root.add_typer(fleet, name="fleet")
    root.add_typer(maps, name="map")
    return root


GROUP = cast(TyperGroup, typer.main.get_command(small_app()))


def run(*arguments: str) -> object:
    return small_app()(list(arguments), prog_name="x", standalone_mode=False)


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("ordr", "order"),  # nearest command of the group
        ("sign", "fleet sign"),  # a subgroup's command without its group
        ("map_save", "map save"),  # with an underscore, as ROS has it
        ("sav", "map save"),  # nearest command of a subgroup
        ("certificates", "fleet"),  # a word of the help: the group, whose commands do not have it
        ("map_saver", "map save"),
        ("SAVE", "map save"),
    ],
)
def test_the_nearest_command_is_suggested(name: str, command: str) -> None:
    assert suggestion(GROUP, name, "x") == f" (did you mean `x {command}`?)"


@pytest.mark.parametrize("name", ["qqq", "of", "", ".*", "(", "\\"])
def test_without_a_near_command_all_are_to_be_listed(name: str) -> None:
    assert suggestion(GROUP, name, "x") == "; `x --help` lists all commands"


@given(st.text(max_size=12))
def test_any_name_gets_a_hint(name: str) -> None:
    assert suggestion(GROUP, name, "x").startswith((" (did you mean `x ", "; `x --help`"))


def test_an_unknown_command_of_a_subgroup_is_named_with_its_path() -> None:
    with pytest.raises(UserError, match=r"`x fleet` has no command 'sing' \(did you mean `x fleet sign`\?\)"):
        run("fleet", "sing")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["map", "save", "--sise", "3"], "`x map save` has no option --sise (did you mean '--size'?)"),
        (["map", "save", "--size", "0"], "`x map save`: invalid value for '--size': must be at least 1; see"),
        (
            ["map", "save", "--size", "a"],
            "`x map save`: invalid value for '--size': must be a whole number; see",
        ),
        (
            ["map", "save", "--size"],
            "`x map save`: option '--size' requires an argument; see `x map save --help`",
        ),
        (["fleet", "sign"], "`x fleet sign`: missing argument 'file'; see `x fleet sign --help`"),
        (["order", "soup"], "`x order`: got unexpected extra argument(s) (soup); see `x order --help`"),
    ],
)
def test_a_wrong_option_or_argument_is_reported_in_one_sentence(arguments: list[str], sentence: str) -> None:
    with pytest.raises(UsageError) as error:
        run(*arguments)
    explanation = explain_usage_error(error.value)
    assert explanation.startswith(sentence) and "\n" not in explanation


def test_a_choice_is_listed_without_the_empty_default() -> None:
    with pytest.raises(UsageError) as error:
        app(["drive", "confirm", "perhaps"], prog_name="x", standalone_mode=False)
    assert "for 'answer': 'perhaps' is not one of 'loaded', 'taken'" in explain_usage_error(error.value)


def test_a_group_alone_prints_its_help_and_succeeds(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("fleet") == 0
    assert "Usage: x fleet" in capsys.readouterr().out
    assert run("map", "save", "-h") == 0
    assert "Usage: x map save" in capsys.readouterr().out
