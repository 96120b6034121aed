"""The delivery round in the web UI, and the commands that are valid during one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

from chefbot.delivery.params import DeliveryParams
from chefbot.delivery.status_messages import (
    ERRAND_NEEDS_WHEN,
    NOT_WHILE_STOPPED,
    ORDER_ENDED,
    QUEUE_CHANGED,
    ROUND_STATES,
    for_guest,
    is_failure,
)
from chefbot.delivery.trays import is_going_home
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, RoundForecast
from chefbot.msgs.std_msgs import String
from chefbot.place_names import display_name
from chefbot.ui import commands as do
from chefbot.ui.display.views import DeliveryView, MappingView, RoundStopView, WaitingOrderView

CONFIRMATION = {"loading": "loaded", "waiting": "taken", "unloading": "taken"}
"""What a person has to confirm, by state of the mission."""
TIME_STEP = 10.0
"""Step of the times of a forecast, s."""
BUSY_STATES = (*ROUND_STATES, "errand")
"""States of the mission in which the robot carries out an order or an errand."""
CONFIRMATION_STATES = {
    do.Loaded: ("loading",),
    do.Taken: ("waiting", "unloading"),
    do.NotTaken: ("waiting",),
}
"""States of the mission in which a confirmation is valid."""

NO_DELIVERIES = "This launch takes no orders; a launch such as `chefbot launch waiter` does"

KITCHEN, HOME = DeliveryParams().kitchen, DeliveryParams().home
"""Names of the places that deliveries need, unless a launch file gives others."""


def delivery_view(status: DeliveryStatus, unanswered: str) -> DeliveryView:
    """Convert the status to the layer; `unanswered` is a warning about an order that was not accepted, or
    empty."""
    choice, missed = status.hold_reason == "choice", status.skipped_reasons
    return DeliveryView(
        queue=status.queue,
        order_id=status.order_id,
        step=unanswered or status.description,
        guest_step=unanswered or for_guest(status),
        state=status.state,
        place=status.place,
        waits_for="choice" if choice else CONFIRMATION.get(status.state, ""),
        choices=_choices(status),
        round_active=status.state in ROUND_STATES,
        delivered=status.delivered,
        missed=missed,
        loaded=status.loaded,
        unserved=_unserved(status),
        failed=status.state == "failed" and (not missed or any(map(is_failure, missed))),
        orders=tuple(WaitingOrderView(id=order.id, places=order.places) for order in status.pending_orders),
        errands=tuple(errand.name for errand in status.errands),
    )


def activity(phase: String | None, status: DeliveryStatus, unanswered: str, mapping: MappingView) -> str:
    """Return what the robot does, one sentence: the round, else the exploration, else the last `phase`; empty if it
    is not known. `unanswered` is a warning about an order."""
    if unanswered or status.state in BUSY_STATES:
        return unanswered or status.description
    if mapping.exploring:
        return mapping.description
    return (phase.data if phase else "") or status.description


def forecast_views(message: RoundForecast) -> tuple[RoundStopView, ...]:
    """Convert a forecast to the layer, rounded, so that it is sent only when an operator sees a change."""
    return tuple(
        RoundStopView(
            place=stop.place,
            distance=float(round(stop.distance)),
            time=TIME_STEP * round(stop.time / TIME_STEP),
            battery=float(round(100.0 * stop.charge)) if stop.charge >= 0.0 else None,
            reachable=stop.reachable,
        )
        for stop in message.stops
    )


def _unserved(status: DeliveryStatus) -> tuple[str, ...]:
    """Return the tables that the robot has given up, once no food is on its way to others."""
    if status.state in ROUND_STATES and status.state not in ("returning", "unloading"):
        return ()
    settled = {*status.delivered, *(place for order in status.pending_orders for place in order.places)}
    return tuple(place for place in status.places if place not in settled)


def _choices(status: DeliveryStatus) -> tuple[str, ...]:
    """Return how the round may continue; where nobody takes the food, it may go back."""
    if status.hold_reason != "choice":
        return ("kitchen",) if status.state == "waiting" else ()
    under_way = status.loaded and status.state in ("driving", "waiting")  # else the kitchen is next anyway
    return ("go_on", "kitchen", "end") if under_way else ("go_on", "end")


def validate_command(command: do.OperatorCommand, places: Collection[str], status: DeliveryStatus) -> None:
    """Validate a command against the current state; UserError with a sentence for the operator if it is
    invalid."""
    requested = _place_names(command)
    missing = [name for name in requested if name not in places]
    if missing:
        raise UserError(f"There is no place called {missing[0]}")
    if isinstance(command, do.Deliver) and KITCHEN in command.tables:
        raise UserError(f"The food comes from {display_name(KITCHEN)}; order it to another place")
    if isinstance(command, do.Deliver) and not status.state:
        raise UserError(NO_DELIVERIES)
    if isinstance(command, do.Goal | do.GoPlace | do.Choose) and status.hold_reason == "stop":
        _check_released(command)
    if isinstance(command, do.DeletePlace):
        _check_deletion(command.name, status)
    if isinstance(command, do.PutPlace) and command.moved and command.name == status.place:
        _check_move(command.name, status)
    if isinstance(command, do.Goal | do.GoPlace) and status.state in ROUND_STATES and not command.when:
        raise UserError(ERRAND_NEEDS_WHEN[:1].upper() + ERRAND_NEEDS_WHEN[1:])
    _check_no_round(command, status)
    if isinstance(command, do.Loaded | do.Taken | do.NotTaken):
        _check_confirmation(command, status)
    if isinstance(command, do.ChangeQueue | do.ShortestOrder):
        left = _tables_of(command, status)
        tables, seen = (command.tables, command.seen) if isinstance(command, do.ChangeQueue) else ((), None)
        if Counter(tables) - Counter(left) or (seen is not None and tuple(seen) != left):
            raise UserError(QUEUE_CHANGED)


def _tables_of(command: do.ChangeQueue | do.ShortestOrder, status: DeliveryStatus) -> tuple[str, ...]:
    """Return the tables that the round of a command still has to serve; a waiting order may be changed, too."""
    if command.order == status.order_id:
        return status.queue
    if isinstance(command, do.ChangeQueue) and command.order:
        for order in status.pending_orders:
            if order.id == command.order:
                return order.places
    cancels = isinstance(command, do.ChangeQueue) and not command.tables
    raise UserError(ORDER_ENDED if cancels and command.order else QUEUE_CHANGED)


def _check_released(command: do.Goal | do.GoPlace | do.Choose) -> None:
    """Raise UserError for a drive during an emergency stop that holds a round; one after the round may wait."""
    if isinstance(command, do.Choose) or command.when != "after":
        raise UserError(NOT_WHILE_STOPPED)


def _check_deletion(name: str, status: DeliveryStatus) -> None:
    """Raise UserError for a place without which a delivery that is possible or under way would fail."""
    if name in (KITCHEN, HOME):
        raise UserError(f"Deliveries need {display_name(name)}; move it instead")
    served = (status.place, *status.queue) if status.state in ROUND_STATES else ()
    if name in (*served, *(errand.name for errand in status.errands)):
        raise UserError(f"The robot is to serve {display_name(name)}; leave it out of the round first")
    if any(name in order.places for order in status.pending_orders):
        raise UserError(f"An order for {display_name(name)} waits; cancel it first")


def _check_move(name: str, status: DeliveryStatus) -> None:
    """Raise UserError for the place that the robot drives to: it would stop where that was."""
    if status.state in ("driving", "returning"):
        raise UserError(f"The robot is on its way to {display_name(name)}; move it once the robot is there")


def _place_names(command: do.OperatorCommand) -> tuple[str, ...]:
    if isinstance(command, do.GoPlace):
        return (command.name,)
    if isinstance(command, do.Patrol):
        return tuple(command.places)
    return tuple(command.tables) if isinstance(command, do.Deliver) else ()


def _check_no_round(command: do.OperatorCommand, status: DeliveryStatus) -> None:
    """Raise UserError for a command that a round excludes; its drive home excludes no other drive."""
    drives = isinstance(command, do.Patrol | do.Follow) and not is_going_home(status)
    if (drives or isinstance(command, do.MapBuilding)) and status.state in ROUND_STATES:
        raise UserError("A delivery round is active; end it first")


def _check_confirmation(command: do.Loaded | do.Taken | do.NotTaken, status: DeliveryStatus) -> None:
    """A confirmation that is received late must not count for the next place."""
    if status.state not in CONFIRMATION_STATES[type(command)]:
        waits = status.state in CONFIRMATION
        problem = (
            "The delivery waits for another confirmation" if waits else "No confirmation is expected now"
        )
        raise UserError(f"{problem}: {status.description}")
    if command.place not in ("", status.place):
        raise UserError(
            f"The robot has left {display_name(command.place)}; check where it is, then press again"
        )


def is_errand(when: str, status: DeliveryStatus) -> bool:
    """Return whether a goal is an errand of the delivery node, which keeps its round; otherwise the
    navigator's."""
    return bool(when) and (status.state in ROUND_STATES or bool(status.hold_reason))
