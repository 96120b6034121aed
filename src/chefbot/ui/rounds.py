"""The round of deliveries as the page shows it, and what a command has to say while there is one."""

from __future__ import annotations

from collections.abc import Collection

from chefbot.delivery.sentences import IN_ROUND, SAY_WHEN, spoken
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.ui import commands as do
from chefbot.ui.layers import Delivery

WAITS = {"loading": "loaded", "waiting": "taken"}
PRESSED_AT = {do.Loaded: "loading", do.Taken: "waiting", do.NotTaken: "waiting"}


def delivery_view(status: DeliveryStatus, unanswered: str) -> Delivery:
    """`unanswered`: what people should know of an order that nobody takes, or nothing."""
    choice = status.held == "choice"
    return Delivery(
        queue=status.queue,
        step=unanswered or status.sentence,
        state=status.state,
        place=status.place,
        waits_for="choice" if choice else WAITS.get(status.state, ""),
        choices=_choices(status) if choice else (),
        in_hand=status.state in IN_ROUND,
        delivered=status.delivered,
        missed=status.missed,
        orders=tuple(order.places for order in status.orders),
        errands=tuple(errand.name for errand in status.errands),
    )


def _choices(status: DeliveryStatus) -> tuple[str, ...]:
    return (
        ("go_on", "end")
        if status.state not in ("loading", "driving", "waiting")
        else ("go_on", "kitchen", "end")
    )


def check(command: do.Command, places: Collection[str], status: DeliveryStatus) -> None:
    """UserError with a sentence for whoever gave a command that makes no sense as things are."""
    wanted = _named(command)
    missing = [name for name in wanted if name not in places]
    if missing:
        raise UserError(f"There is no place called {missing[0]}")
    if isinstance(command, do.Goal | do.GoPlace) and status.state in IN_ROUND and not command.when:
        raise UserError(SAY_WHEN[:1].upper() + SAY_WHEN[1:])
    if isinstance(command, do.Loaded | do.Taken | do.NotTaken):
        _check_press(command, status)


def _named(command: do.Command) -> tuple[str, ...]:
    if isinstance(command, do.GoPlace):
        return (command.name,)
    return tuple(command.tables) if isinstance(command, do.Deliver) else ()


def _check_press(command: do.Loaded | do.Taken | do.NotTaken, status: DeliveryStatus) -> None:
    """A press that comes late must not count for the next place."""
    if status.state != PRESSED_AT[type(command)]:
        raise UserError(f"Nothing is to be pressed now: {status.sentence}")
    if command.place not in ("", status.place):
        raise UserError(f"The robot has left {spoken(command.place)}; look again, then press")


def through_the_round(when: str, status: DeliveryStatus) -> bool:
    """Whether a drive is an errand of the delivery's, which keeps its round; else the navigator's alone."""
    return bool(when) and (status.state in IN_ROUND or bool(status.held))
