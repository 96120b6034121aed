"""`chefbot drive goto`, `patrol`, `follow`, `cancel`, `stop` and `release`, through the web UI of a running robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from uuid import uuid4

from rich.console import Console

from chefbot.cli import running_robot
from chefbot.cli.running_robot import (
    ADD_PLACES,
    await_failure,
    await_refusal,
    failed_goals,
    find_shown_place,
    known_places,
)
from chefbot.delivery.status_messages import ERRAND_NEEDS_WHEN, join_names
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.plural import number_of
from chefbot.ui.command_types import When
from chefbot.ui.commands import (
    Cancel,
    ChangeQueue,
    Follow,
    Goal,
    GoPlace,
    OperatorCommand,
    Patrol,
    ReleaseStop,
    Stop,
)
from chefbot.ui.remote.web_ui_client import WebUiClient

console = Console(highlight=False, soft_wrap=True, markup=False)


def send_goal(target: list[str], page: str, when: When = "") -> None:
    """Send a goal; `when` is needed during a delivery.

    Raises UserError for an unknown place, an invalid pose, or when the robot refuses it or gives it up at once.
    """
    with WebUiClient(page) as robot:
        goal, failed_before = _goal(target, robot, when), failed_goals(robot)
        after_round = when == "after" and _in_round(robot)
        robot.send(goal)
        _await_response(robot, failed_before, after_round=after_round)
    place = " ".join(target)
    if after_round:
        console.print(f"The robot drives to {place} after the round.")
    else:
        console.print(f"Driving to {place}; `chefbot drive cancel` cancels it.")


def _in_round(robot: WebUiClient) -> bool:
    """Return whether a delivery round is in progress; without one a goal is driven to at once."""
    delivery = robot.wait_for("delivery", running_robot.LAYER_TIMEOUT)
    return delivery is not None and delivery["round_active"]


def _await_response(robot: WebUiClient, failed_before: int, *, after_round: bool) -> None:
    """Raise UserError if the robot refuses the goal or gives it up at once."""
    try:
        if after_round:
            await_refusal(robot)
        else:
            await_failure(robot, failed_before)
    except UserError as refusal:
        if ERRAND_NEEDS_WHEN[1:] in str(refusal):
            raise UserError(f"{refusal} (--when now, after or instead)") from None
        raise


def send_patrol(targets: list[str], rounds: int, without_stops: bool, page: str) -> None:
    """Send a patrol over named places; raises UserError for an unknown place, or when the robot refuses it
    or gives it up at once."""
    with WebUiClient(page) as robot:
        places = known_places(robot)
        if not places:
            raise UserError(f"the robot at {robot.url} has no named places to patrol; {ADD_PLACES}")
        names = [find_shown_place(robot, target, places) for target in targets]
        failed_before = failed_goals(robot)
        robot.send(Patrol(names, rounds, without_stops))
        await_failure(robot, failed_before)
    often = "until `chefbot drive cancel`" if rounds == 0 else f"in {number_of(rounds, 'round')}"
    console.print(f"Patrolling {', '.join(names)} {often}.")


def send_follow(person: int, page: str) -> None:
    """Let the robot follow a person; raises UserError when it refuses or gives it up at once."""
    with WebUiClient(page) as robot:
        failed_before = failed_goals(robot)
        robot.send(Follow(person))
        await_failure(robot, failed_before)
    who = f"person {person}" if person else "the nearest person ahead"
    console.print(f"Following {who}; `chefbot drive cancel` ends it.")


def _goal(target: list[str], robot: WebUiClient, when: When) -> OperatorCommand:
    if len(target) == 1 or _numbers(target) is None:
        places = known_places(robot)
        if not places:
            raise UserError(
                f"the robot at {robot.url} has no named places; give a pose X Y [YAW], in m and degrees, or "
                f"{ADD_PLACES}"
            )
        return GoPlace(find_shown_place(robot, " ".join(target), places), when)
    return Goal(*pose_of(target), when)


def pose_of(texts: list[str]) -> SE2:
    """Return the pose of X Y [YAW], in m and degrees; raises UserError for other texts."""
    numbers = _numbers(texts)
    if numbers is None or not all(map(math.isfinite, numbers)):
        raise UserError(f"a pose needs finite numbers, X Y [YAW] in m and degrees; got {' '.join(texts)}")
    if len(numbers) not in (2, 3):
        raise UserError(f"a pose is X Y [YAW], in m and degrees; got {number_of(len(numbers), 'number')}")
    x, y, *yaw = numbers
    return SE2(x, y, math.radians(sum(yaw)))


def _numbers(texts: list[str]) -> list[float] | None:
    """Return the numbers, or None if one of the texts is not a number."""
    try:
        return [float(text) for text in texts]
    except ValueError:
        return None


def cancel_order(number: int, page: str) -> None:
    """Cancel one of the orders that wait, by its number in `chefbot drive status`; UserError if there is none."""
    with WebUiClient(page) as robot:
        delivery = robot.wait_for("delivery", running_robot.RESPONSE_TIMEOUT)
        orders = delivery["orders"] if delivery else []
        if number > len(orders):
            raise UserError(
                f"there is no waiting order {number}; `chefbot drive status` numbers the waiting orders"
            )
        order = orders[number - 1]
        robot.send(ChangeQueue([], order["id"]))
        robot.wait_until(
            lambda: order not in robot.latest["delivery"]["orders"], running_robot.RESPONSE_TIMEOUT
        )
        if order in robot.latest["delivery"]["orders"]:
            raise UserError(f"the robot at {robot.url} has not cancelled order {number}")
    console.print(f"The order to {join_names(order['places'])} is cancelled.")


def cancel_goal(page: str) -> None:
    """Cancel the goal, a patrol, the following and all deliveries."""
    with WebUiClient(page) as robot:
        robot.send(Cancel())
        await_refusal(robot)
    console.print("Goal, patrol, following and deliveries are cancelled.")


def press_stop(page: str) -> int:
    """Press the emergency stop. Returns the exit code: 1 without confirmation by the drive base."""
    key = uuid4().hex
    with WebUiClient(page) as robot:
        robot.send(Stop(key))
        confirmed = _await_stop(robot, lambda stop: key in stop["confirmed"])
    console.print(
        "Stopped; `chefbot drive release` releases the emergency stop."
        if confirmed
        else "The drive base has not confirmed the stop: switch the robot off at its power switch."
    )
    return 0 if confirmed else 1


def release_stop(page: str) -> int:
    """Release the emergency stop. Returns the exit code: 1 if it stays active."""
    with WebUiClient(page) as robot:
        stop = robot.wait_for("stop", running_robot.RESPONSE_TIMEOUT)
        if stop is None:
            raise UserError(f"the robot at {robot.url} does not report the state of its emergency stop")
        if not (stop["stopped"] or stop["requested"]):
            console.print("No emergency stop is active.")
            return 0
        robot.send(ReleaseStop(stop["pressed"]))
        released = _await_stop(robot, lambda stop: not stop["stopped"])
        reason = (robot.latest.get("status") or {}).get("reason", "")
    active = f"The emergency stop is still active. {reason}".strip()
    console.print("The emergency stop is released." if released else active)
    return 0 if released else 1


def _await_stop(robot: WebUiClient, condition: Callable[[Any], bool]) -> bool:
    """Return whether the stop layer meets the condition within the timeout."""

    def met() -> bool:
        stop = robot.latest.get("stop")
        return stop is not None and condition(stop)

    return robot.wait_until(met, running_robot.RESPONSE_TIMEOUT)
