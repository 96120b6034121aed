"""The commands of `chefbot drive`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from chefbot.cli.command_group import new_group
from chefbot.cli.parameters import JOIN, PAGE, WEB_UI
from chefbot.errors import UserError

drive_app = new_group("Drive: keyboard, gamepad, goals, deliveries, emergency stop.")
_KEY_VALUES = typer.Argument(help="arguments of the launch, key:=value ...")


@drive_app.command("keyboard")
def keyboard(
    arguments: Annotated[list[str] | None, _KEY_VALUES] = None,
    page: Annotated[str, PAGE] = WEB_UI,
    join: Annotated[list[str] | None, JOIN] = None,
) -> None:
    """Drive with the keys of this terminal, as launch keyboard_teleop; from another machine with --join."""
    _teleoperate("keyboard_teleop", "remote_teleop", arguments or [], page, join or [])


@drive_app.command("gamepad")
def gamepad(
    arguments: Annotated[list[str] | None, _KEY_VALUES] = None,
    page: Annotated[str, PAGE] = WEB_UI,
    join: Annotated[list[str] | None, JOIN] = None,
) -> None:
    """Drive with a gamepad, as launch gamepad_teleop; from another machine with --join."""
    _teleoperate("gamepad_teleop", "remote_gamepad", arguments or [], page, join or [])


def _teleoperate(local: str, remote: str, arguments: list[str], page: str, join: list[str]) -> None:
    from chefbot.launcher.launch import run_launch

    if join:
        raise typer.Exit(run_launch(remote, arguments, join))
    raise typer.Exit(run_launch(local, [f"page:={page}", *arguments]))


@drive_app.command("status")
def status(page: Annotated[str, PAGE] = WEB_UI) -> None:
    """Print where the robot is, what it does and what is wrong; exit code 1 while its emergency stop is active."""
    from chefbot.cli.drive.status import show_status

    raise typer.Exit(show_status(page))


@drive_app.command("goto")
def goto(
    target: Annotated[
        list[str], typer.Argument(help="goal: a named place, a table number, or X Y [YAW] in m and degrees")
    ],
    page: Annotated[str, PAGE] = WEB_UI,
    when: Annotated[
        Literal["", "now", "after", "instead"],
        typer.Option(
            help="what to do with a delivery under way: now pauses it, after completes it first, instead ends it"
        ),
    ] = "",
) -> None:
    """Send the robot to a named place, or to a pose in the map frame (`--` before negative numbers)."""
    from chefbot.cli.drive.goals import send_goal

    send_goal(target, page, when)


@drive_app.command("patrol")
def patrol(
    places: Annotated[list[str], typer.Argument(help="named places in order, such as kitchen 3 7")],
    rounds: Annotated[
        int, typer.Option(min=0, max=10_000, help="number of rounds; 0: until `chefbot drive cancel`")
    ] = 1,
    without_stops: Annotated[
        bool, typer.Option("--without-stops", help="drive through the places; stop at the last one only")
    ] = False,
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Drive to places in order, in one or more rounds."""
    from chefbot.cli.drive.goals import send_patrol

    send_patrol(places, rounds, without_stops, page)


@drive_app.command("follow")
def follow(
    person: Annotated[
        int, typer.Argument(min=0, help="number of the person in the web UI; 0: the nearest one ahead")
    ] = 0,
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Follow a person at 1 m until `chefbot drive cancel`, or until the robot has lost the person."""
    from chefbot.cli.drive.goals import send_follow

    send_follow(person, page)


@drive_app.command("place")
def place(
    name: Annotated[
        str,
        typer.Argument(
            help="name of the place, such as kitchen, home, 3 (table_3); default: list all places"
        ),
    ] = "",
    pose: Annotated[
        list[str] | None,
        typer.Argument(
            help="pose of the place, X Y [YAW] in the map frame, m and degrees; default: where the robot is"
        ),
    ] = None,
    remove: Annotated[bool, typer.Option("--remove", help="remove this place")] = False,
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Store where the robot is, or a pose, as a named place of its map; without a name, list the places."""
    from chefbot.cli.drive.places import print_places, put_place, remove_place

    if remove and (pose or not name):
        raise UserError("--remove needs the name of a place, and no pose")
    if not name:
        print_places(page)
    elif remove:
        remove_place(name, page)
    else:
        put_place(name, pose or [], page)


@drive_app.command("cancel")
def cancel(
    order: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="number of the waiting order to cancel, as in `chefbot drive status`; without it all are cancelled",
        ),
    ] = None,
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Cancel the goal, a patrol, the following and all deliveries, or one order that waits."""
    from chefbot.cli.drive.goals import cancel_goal, cancel_order

    if order is None:
        cancel_goal(page)
    else:
        cancel_order(order, page)


@drive_app.command("stop")
def stop(page: Annotated[str, PAGE] = WEB_UI) -> None:
    """Press the emergency stop; exit code 1 if the robot does not confirm it."""
    from chefbot.cli.drive.goals import press_stop

    raise typer.Exit(press_stop(page))


@drive_app.command("release")
def release(page: Annotated[str, PAGE] = WEB_UI) -> None:
    """Release the emergency stop; exit code 1 if it stays active."""
    from chefbot.cli.drive.goals import release_stop

    raise typer.Exit(release_stop(page))


@drive_app.command("order")
def order(
    tables: Annotated[
        list[str], typer.Argument(help="table numbers or names of places in order, such as 3 7 5")
    ],
    page: Annotated[str, PAGE] = WEB_UI,
    wait: Annotated[bool, typer.Option("--wait/--no-wait", help="wait until the robot is home again")] = True,
) -> None:
    """Order a delivery to tables; exit code 1 if a table was not served."""
    from chefbot.cli.drive.orders import order_delivery

    raise typer.Exit(order_delivery(tables, page, wait))


@drive_app.command("confirm")
def confirm(
    answer: Annotated[
        Literal["", "loaded", "taken", "not-taken", "unloaded", "go-on", "kitchen", "end"],
        typer.Argument(
            help="what to confirm. loaded: the food is on the tray; taken: the guest has it; not-taken: it stays "
            "on the tray; unloaded: what nobody took is off it; after a stop or an additional goal: go-on, kitchen "
            "(load again), end. Default: show what the delivery waits for"
        ),
    ] = "",
    page: Annotated[str, PAGE] = WEB_UI,
) -> None:
    """Confirm what a delivery waits for, such as loaded or taken; without an answer, show it."""
    from chefbot.cli.drive.orders import confirm_step

    raise typer.Exit(confirm_step(answer, page))


@drive_app.command("deliveries")
def deliveries(
    robot: Annotated[str, typer.Argument(help="name of the robot; not needed if it is the only one")] = "",
    last: Annotated[int, typer.Option(min=1, help="number of rounds to print, the newest ones")] = 50,
    csv: Annotated[Path | None, typer.Option(help="CSV file to write instead, one line per place")] = None,
) -> None:
    """Print the robot's delivery rounds: when, ordered by whom, what became of each table; on its own computer."""
    from chefbot.cli.drive.deliveries import print_deliveries

    print_deliveries(robot, last, csv)


@drive_app.command("history")
def history(
    robot: Annotated[str, typer.Argument(help="name of the robot; not needed if it is the only one")] = "",
    last: Annotated[int, typer.Option(min=1, help="number of entries to print, the newest ones")] = 50,
    connections: Annotated[
        bool, typer.Option("--connections", help="also print who connected and disconnected")
    ] = False,
) -> None:
    """Print who gave which command in the web UI and when; on the robot's own computer."""
    from chefbot.cli.drive.history import print_history

    print_history(robot, last, connections)
