"""`chefbot drive order` and `chefbot drive confirm`: deliveries of a running robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console

from chefbot.causes.reports import STOP
from chefbot.causes.sentences import EFFECT_NAMES
from chefbot.cli import running_robot
from chefbot.cli.parameters import WEB_UI
from chefbot.cli.running_robot import find_shown_place, known_places, with_shown_labels
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.place_names import display_name
from chefbot.ui.commands import Choose, Deliver, Loaded, NotTaken, OperatorCommand, Taken
from chefbot.ui.remote.web_ui_client import WebUiClient

ANSWERS: dict[str, OperatorCommand] = {
    "loaded": Loaded(),
    "taken": Taken(),
    "not-taken": NotTaken(),
    "unloaded": Taken(),
    "go-on": Choose("go_on"),
    "kitchen": Choose("kitchen"),
    "end": Choose("end"),
}
"""What a person can confirm during a delivery."""
DOING = {
    "loading": "the robot is loaded in the {}.",
    "driving": "the robot is on the way to {}.",
    "waiting": "the food is taken at {}.",
    "unloading": "the robot is unloaded in the {}.",
}
"""What is done for another order, by state of the mission."""
STOPPED = EFFECT_NAMES[STOP]
"""Effect of the causes for which the robot stands, as in the web UI's list."""
console = Console(highlight=False, soft_wrap=True, markup=False)


def order_delivery(tables: Sequence[str], page: str, wait: bool) -> int:
    """Order a delivery. Returns the exit code: 1 if not every table was served.

    Raises UserError if no robot that delivers runs at `page`, or if it refuses the order.
    """
    with WebUiClient(page) as robot:
        places = _places_of_delivery(robot)
        names = [find_shown_place(robot, table, places) for table in tables]
        before = robot.latest["delivery"]
        robot.send(Deliver(names))
        if wait:
            return _follow_delivery(robot, names, page)
        if not _await_acceptance(robot, before, names):
            raise UserError(f"not ordered: {with_shown_labels(robot, robot.latest['delivery']['step'])}")
        _print(robot, f"ordered: {', '.join(map(display_name, names))}")
        return 0


def _places_of_delivery(robot: WebUiClient) -> dict[str, SE2]:
    places = known_places(robot)
    if not places or robot.wait_for("delivery", running_robot.RESPONSE_TIMEOUT) is None:
        raise UserError(
            f"the robot at {robot.url} does not deliver; it must run `chefbot launch amcl_demo` with a map "
            "that has named places, a kitchen and a home among them (`chefbot drive place NAME` stores one)"
        )
    return places


def _await_acceptance(robot: WebUiClient, before: Mapping[str, Any], names: list[str]) -> bool:
    """Return whether an order begins, or is queued, after the delivery was as `before`."""
    ended = lambda: _is_accepted(robot.latest["delivery"], before, names) or _has_failed(robot, before)  # noqa: E731
    robot.wait_until(ended, running_robot.RESPONSE_TIMEOUT)
    return _is_accepted(robot.latest["delivery"], before, names)


def _is_accepted(delivery: Mapping[str, Any], before: Mapping[str, Any], names: list[str]) -> bool:
    begun = delivery["order_id"] not in ("", before["order_id"]) and _is_served(delivery, names)
    return begun or _waiting(delivery).count(names) > _waiting(before).count(names)


def _waiting(delivery: Mapping[str, Any]) -> list[list[str]]:
    """Return the places of each order that waits."""
    return [order["places"] for order in delivery["orders"]]


def _has_failed(robot: WebUiClient, before: Mapping[str, Any]) -> bool:
    delivery = robot.latest["delivery"]
    return delivery["state"] == "failed" and delivery != before


def _is_served(delivery: Mapping[str, Any], names: Sequence[str]) -> bool:
    """Return whether a delivery that has begun has all of these places."""
    return {*names} <= {delivery["place"], *delivery["queue"], *delivery["delivered"]}


def confirm_step(answer: str, page: str) -> int:
    """Send one of ANSWERS; with "", show what the delivery waits for.

    Returns the exit code: 1 if the robot did not continue.
    """
    with WebUiClient(page) as robot:
        before = _delivery(robot)
        if answer:
            command = ANSWERS[answer]
            if isinstance(command, Choose) and command.choice not in before["choices"]:
                raise UserError(f"the delivery does not wait for {answer!r}: {before['step']}")
            robot.send(command)
            robot.wait_until(lambda: robot.latest["delivery"] != before, running_robot.RESPONSE_TIMEOUT)
        now = robot.latest["delivery"]
        _print(robot, now["step"])
        robot.wait_for("causes", running_robot.LAYER_TIMEOUT)
        _print_stops(robot, set())
        _print_answers(now, page)
        return 1 if answer and now == before else 0


def _delivery(robot: WebUiClient) -> Any:
    delivery = robot.wait_for("delivery", running_robot.RESPONSE_TIMEOUT)
    if delivery is None:
        raise UserError(f"the robot at {robot.url} does not deliver; it must run `chefbot launch amcl_demo`")
    return delivery


def _print_answers(delivery: Mapping[str, Any], page: str) -> None:
    """Print the commands that confirm what the delivery waits for."""
    choices = [choice.replace("_", "-") for choice in delivery["choices"]]
    taken = ["taken", "not-taken"] if delivery["state"] == "waiting" else ["unloaded"]
    answers = {"loaded": ["loaded"], "taken": taken, "choice": choices}
    option = "" if page == WEB_UI else f" --page '{page}'"
    for answer in answers.get(delivery["waits_for"], []):
        console.print(f"  chefbot drive confirm {answer}{option}")


def _follow_delivery(robot: WebUiClient, names: list[str], page: str) -> int:
    """Print every step until the robot is home again or has failed; return the exit code."""
    begun = busy = False
    printed = own_round = ""
    missed = names
    stops: set[int] = set()
    while True:
        _print_stops(robot, stops)
        if robot.receive() != "delivery":
            continue
        delivery = robot.latest["delivery"]
        begun = begun or _is_served(delivery, names)
        if begun:
            own_round = own_round or delivery["order_id"]
        if own_round and delivery["order_id"] not in ("", own_round):  # the next round has begun
            return _exit_code(missed, "")
        if names in _waiting(delivery) and not begun:
            printed = _print_once(robot, f"Behind other orders: {_progress(robot.latest)}", printed)
            busy = True
            continue
        if delivery["step"] != printed:
            printed = _print_once(robot, delivery["step"], printed)
            _print_answers(delivery, page)
        missed = [name for name in names if name not in delivery["delivered"]]
        idle = delivery["state"] in ("idle", "errand") and not delivery["waits_for"]
        if delivery["state"] == "failed" or (idle and (busy or not missed)):
            return _exit_code(missed, delivery["state"])
        busy = busy or not idle


def _progress(layers: Mapping[str, Any]) -> str:
    """Return what the robot does for another order, without the sentence for the person who stands at it."""
    delivery, stop = layers["delivery"], layers.get("stop")
    if (stop and stop["stopped"]) or delivery["waits_for"] == "choice":
        return str(delivery["step"])
    doing = DOING.get(delivery["state"])
    return (
        delivery["step"]
        if doing is None or not delivery["place"]
        else doing.format(display_name(delivery["place"]))
    )


def _print_stops(robot: WebUiClient, printed: set[int]) -> None:
    """Print why the robot stands now; `printed` are the numbers of the causes that were printed before."""
    for cause in robot.latest.get("causes", ()):
        if cause["effect"] == STOPPED and cause["ended"] is None and cause["id"] not in printed:
            printed.add(cause["id"])
            _print(robot, f"  {cause['sentence']}")


def _print_once(robot: WebUiClient, sentence: str, printed: str) -> str:
    if sentence != printed:
        _print(robot, sentence)
    return sentence


def _print(robot: WebUiClient, sentence: str) -> None:
    console.print(with_shown_labels(robot, sentence))


def _exit_code(missed: list[str], state: str) -> int:
    if missed:
        console.print(f"not delivered: {', '.join(missed)}")
    return 1 if missed or state == "failed" else 0
