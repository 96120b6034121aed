"""`chefbot deliver`, `chefbot round` and `chefbot map_saver`: verbs for a robot that runs, by its page."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.storage.map_files import save_map
from chefbot.storage.places import find_place, places_path, save_places
from chefbot.ui.commands import Choose, Deliver, Loaded, NotTaken, OperatorCommand, Taken
from chefbot.ui.web_ui_client import WebUiClient

RESPONSE_TIMEOUT = 10.0
"""Seconds for a layer to come: a robot that has just started makes its first map within a few."""
OWN_PAGE = "http://127.0.0.1:8080"
"""Where the verbs look for a robot that nobody names."""
REFUSAL = 0.5
"""Seconds in which a robot says no, if it does."""
PRESSES: dict[str, OperatorCommand] = {
    "loaded": Loaded(),
    "taken": Taken(),
    "not-taken": NotTaken(),
    "go-on": Choose("go_on"),
    "kitchen": Choose("kitchen"),
    "end": Choose("end"),
}
"""What people press during a round, by the word for it in a terminal."""
console = Console(highlight=False, soft_wrap=True)


def order_delivery(tables: Sequence[str], page: str, wait: bool) -> int:
    """Exit code: 1 if not every table was served. UserError if no robot that delivers runs at `page`."""
    with WebUiClient(page) as robot:
        known = _places(robot)
        if not known or robot.wait_for("delivery", RESPONSE_TIMEOUT) is None:
            raise UserError(
                f"the robot at {page} does not deliver; it must run `chefbot launch amcl_demo` with a map "
                "that has named places beside it"
            )
        names = [find_place(table, known) for table in tables]
        robot.send(Deliver(names))
        if wait:
            return _watch(robot, names)
        robot.receive(REFUSAL)
        console.print(f"ordered: {', '.join(names)}")
        return 0


def press_round(press: str, page: str) -> int:
    """Press one of PRESSES, or none to see what the round waits for. Exit code: 1 if the robot did not do it."""
    with WebUiClient(page) as robot:
        before = _delivery(robot, page)
        if press:
            command = PRESSES[press]
            if isinstance(command, Choose) and command.choice not in before["choices"]:
                raise UserError(f"the round does not wait for that: {before['step']}")
            robot.send(command)
            _await_change(robot, before)
        now = robot.latest["delivery"]
        console.print(now["step"], markup=False)
        _say_how(now, page)
        return 1 if press and now == before else 0


def _await_change(robot: WebUiClient, before: Mapping[str, Any]) -> None:
    """Until the deliveries have gone on, for a while."""
    end = time.monotonic() + RESPONSE_TIMEOUT
    while robot.latest["delivery"] == before and (rest := end - time.monotonic()) > 0:
        robot.receive(rest)


def _delivery(robot: WebUiClient, page: str) -> Any:
    shown = robot.wait_for("delivery", RESPONSE_TIMEOUT)
    if shown is None:
        raise UserError(f"the robot at {page} does not deliver; it must run `chefbot launch amcl_demo`")
    return shown


def _say_how(delivery: Mapping[str, Any], page: str) -> None:
    """How a person at a terminal presses what the round waits for."""
    ways = {"loaded": ["loaded"], "taken": ["taken", "not-taken"], "choice": _names(delivery["choices"])}
    where = "" if page == OWN_PAGE else f" --page '{page}'"
    for name in ways.get(delivery["waits_for"], []):
        console.print(f"  chefbot round {name}{where}", markup=False)


def _names(choices: Sequence[str]) -> list[str]:
    return [choice.replace("_", "-") for choice in choices]


def _watch(robot: WebUiClient, names: list[str]) -> int:
    """Tell every step until the robot has come home or given up."""
    begun = busy = False
    told = ""
    while True:
        if robot.receive() != "delivery":
            continue
        delivery = robot.latest["delivery"]
        begun = begun or {*names} <= {delivery["place"], *delivery["queue"], *delivery["delivered"]}
        if names in delivery["orders"] and not begun:
            told = _say_once(f"Behind other orders: {delivery['step']}", told)
            busy = True
            continue
        if delivery["step"] != told:
            told = _say_once(delivery["step"], told)
            _say_how(delivery, robot.url)
        missed = [name for name in names if name not in delivery["delivered"]]
        idle = delivery["state"] in ("idle", "errand") and not delivery["waits_for"]
        if delivery["state"] == "failed" or (idle and (busy or not missed)):
            return _verdict(missed, delivery["state"])
        busy = busy or not idle


def _say_once(sentence: str, told: str) -> str:
    if sentence != told:
        console.print(sentence, markup=False)
    return sentence


def _verdict(missed: list[str], state: str) -> int:
    if missed:
        console.print(f"not delivered: {', '.join(missed)}")
    return 1 if missed or state == "failed" else 0


def save_running_map(file: Path, page: str) -> None:
    """Save the map that the robot shows, and the places it knows unless some are there already."""
    with WebUiClient(page) as robot:
        grid = robot.wait_for("map", RESPONSE_TIMEOUT)
        if grid is None:
            raise UserError(
                f"the robot at {page} has no map yet; start `chefbot launch gmapping_demo` and drive it about"
            )
        places = _places(robot)
    path = save_map(file, grid)
    height, width = (cells * grid.resolution for cells in grid.cells.shape)
    console.print(
        f"saved {path}: {width:.1f} by {height:.1f} m, {grid.resolution:.3g} m a cell", markup=False
    )
    if places:
        _save_places(places_path(path), places)


def _save_places(path: Path, places: Mapping[str, SE2]) -> None:
    """A person may have edited them: never overwritten."""
    if path.exists():
        console.print(
            f"kept {path}, which was there; delete it to have the robot's places saved", markup=False
        )
        return
    save_places(path, places)
    console.print(f"saved {path}: {len(places)} places", markup=False)


def _places(robot: WebUiClient) -> dict[str, SE2]:
    """None known is no fault here: they come with the first frames or not at all."""
    shown = robot.wait_for("places", 1.0) or []
    return {place["name"]: SE2(place["x"], place["y"], place["yaw"]) for place in shown}
