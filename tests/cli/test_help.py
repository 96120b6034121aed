"""The help names what there is."""

import pytest
from typer.testing import CliRunner

from chefbot.cli.app import app
from chefbot.cli.parameters import ROBOTS, WORLDS
from chefbot.cli.tools.commands import TOOLS
from chefbot.robot.load import built_in_robots
from chefbot.sim.world.world import built_in_worlds


def items(text: str) -> list[str]:
    return text.split(", ")


def test_every_robot_and_world_is_named() -> None:
    assert set(items(ROBOTS)) == {*built_in_robots(), "or a robot file"}
    assert set(items(WORLDS)) == {*built_in_worlds(), "a world file", "or any ROS map.yaml"}


@pytest.mark.parametrize(
    "verb", ["design", "draw", "check", "export solids", "export urdf", "export sdf", "export mjcf"]
)
def test_help_of_each_command_with_a_robot_lists_the_robots(verb: str) -> None:
    shown = CliRunner().invoke(app, ["robot", *verb.split(), "--help"]).output
    assert all(name in shown for name in built_in_robots())


@pytest.mark.parametrize("name", TOOLS)
def test_every_tool_command_has_a_help_sentence(name: str) -> None:
    for command in TOOLS[name].registered_commands:
        shown = CliRunner().invoke(TOOLS[name], [command.name, "--help"])
        assert shown.exit_code == 0 and (command.callback.__doc__ or "").endswith(".")
