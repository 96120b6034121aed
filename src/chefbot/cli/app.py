"""The command `chefbot`: its groups, the text without arguments, and the errors of bad input."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from chefbot import __version__
from chefbot.cli.board.commands import board_app
from chefbot.cli.command_group import CommandGroup, UsageError, explain_usage_error, new_group
from chefbot.cli.doctor.commands import doctor_app
from chefbot.cli.drive.commands import drive_app
from chefbot.cli.error_handling import choose_kernel_folder, user_errors_reported
from chefbot.cli.fleet.commands import fleet_app
from chefbot.cli.map.commands import map_app
from chefbot.cli.page.commands import page_app
from chefbot.cli.robot.commands import robot_app
from chefbot.cli.run.commands import demo, launch, replay, sim
from chefbot.cli.run.prove import prove
from chefbot.cli.tools.commands import TOOLS
from chefbot.cli.why.commands import why
from chefbot.cli.world.commands import world_app
from chefbot.errors import UserError

PANELS = RUN, DESIGN, OPERATE, GRAPH = (
    "Run",
    "Design and build a robot",
    "Operate a running robot",
    "Inspect the ROS graph",
)
"""Panels of the help, in order."""
WELCOME = """\
chefbot: design, simulate and run a differential-drive robot from one YAML file.

  See a robot drive:      chefbot demo
  Describe your robot:    chefbot robot design --write my_robot.yaml
  Run it:                 chefbot launch gmapping_demo robot:=my_robot.yaml    (chefbot launch lists all)

All commands: chefbot --help
"""


class MainGroup(CommandGroup):
    """The top-level group, which lists its commands by panel."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands in the order of PANELS."""
        del ctx
        panels = {name: getattr(command, "rich_help_panel", "") for name, command in self.commands.items()}
        return sorted(panels, key=lambda name: PANELS.index(panels[name]))


app = new_group(
    "Design, simulate and run a differential-drive robot from one YAML file.",
    cls=MainGroup,
    no_args_is_help=False,
    invoke_without_command=True,
    add_completion=True,
    pretty_exceptions_enable=False,
)


@app.callback()
def options(
    ctx: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True)
    ] = False,
) -> None:
    """Design, simulate and run a differential-drive robot from one YAML file."""
    if version:
        sys.stdout.write(f"{__version__}\n")
        raise typer.Exit
    if ctx.invoked_subcommand is None:
        sys.stdout.write(WELCOME)


app.command(rich_help_panel=RUN)(demo)
app.command(rich_help_panel=RUN)(launch)
app.command(rich_help_panel=RUN)(replay)
app.command(rich_help_panel=RUN)(sim)
app.command(rich_help_panel=RUN)(prove)
app.command(rich_help_panel=RUN)(why)
app.add_typer(world_app, name="world", rich_help_panel=RUN)
app.add_typer(doctor_app, name="doctor", rich_help_panel=RUN)
app.add_typer(robot_app, name="robot", rich_help_panel=DESIGN)
app.add_typer(board_app, name="board", rich_help_panel=DESIGN)
app.add_typer(drive_app, name="drive", rich_help_panel=OPERATE)
app.add_typer(map_app, name="map", rich_help_panel=OPERATE)
app.add_typer(page_app, name="page", rich_help_panel=OPERATE)
app.add_typer(fleet_app, name="fleet", rich_help_panel=OPERATE)
for name, tool_app in TOOLS.items():
    app.add_typer(tool_app, name=name, rich_help_panel=GRAPH)


def main() -> None:
    """Run a command. Bad input is reported in one sentence on standard error with exit code 2."""
    choose_kernel_folder()
    with user_errors_reported():
        try:
            code = app(prog_name="chefbot", standalone_mode=False)
        except UsageError as error:
            raise UserError(explain_usage_error(error)) from None
        except typer.Abort:
            raise KeyboardInterrupt from None
        raise SystemExit(code if isinstance(code, int) else 0)
