"""Messages of the delivery status, as shown to people."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.msgs.chefbot_msgs.deliveries import BY_PERSONS, ENDED_BEFORE, LEFT_OUT, NOT_TAKEN
from chefbot.place_names import display_name
from chefbot.plural import number_of

IDLE = "Waiting for an order."
AT_HOME = "At home, waiting for an order."
CANCELLED = "The delivery was cancelled."
DIVERTED = "The robot was sent elsewhere."
ORDER_KEPT = "The emergency stop is active. The order is kept; release STOP, then choose whether to start."
NOT_WHILE_STOPPED = "The emergency stop is active. Release STOP first."
CANCELLED_TOO = "The delivery and all waiting orders ({}) were cancelled."
ORDER_CANCELLED = "The order was cancelled."
FOOD_LEFT = "There is still food on the robot."
ORDER_ENDED = "This order has already ended or was cancelled."
QUEUE_CHANGED = "The round has changed in the meantime; check it and try again."
TOO_MANY_TO_SORT = (
    "The shortest route can be computed for up to {} tables; leave some out, or sort them yourself."
)
ROUTES_NOT_KNOWN = "The routes between the tables that are left are not known yet."
NOTHING_LEFT = "The round has no table left to serve."
ERRAND_ENDED = "The drive was ended."
ROUND_WAITS, ORDER_WAITS = "The round waits. Choose:", "An order waits. Choose:"
NO_PLACE = "The order names no place."
NO_PATH = "No path on the map to: {}. The order is kept."
LOW_BATTERY = "The battery is low."
PARKING = "The battery is too low for the drive home; the robot parks."
PARKED = "Parked with a low battery. Charge it, then send the robot home."
PARKING_PLACE = "a parking place"
MEANWHILE = " The round waits."
ERRAND_NEEDS_WHEN = "a round is under way; choose when to drive there: now, after it, or instead of it"
IDLE_STATES = ("idle", "failed")
"""States in which no round is in progress and the robot waits for an order."""
ROUND_STATES = ("loading", "driving", "waiting", "returning", "unloading")
"""States of a round; `waiting` is at a table. In the state `errand` the robot drives without food on request."""


def join_names(places: Sequence[str]) -> str:
    """Return the display names of several places as a list in a sentence."""
    *first, last = map(display_name, places)
    return f"{', '.join(first)} and {last}" if first else last


def _about(sentence: str) -> Callable[[str], str]:
    """Return the function that puts the display name of a place into a sentence."""
    return lambda place: sentence.format(display_name(place) or "the place on the map")


on_the_way = _about("On the way to {}.")
with_food_back = _about("On the way to {} with the food that nobody took.")
at = _about("At {}.")
not_taken = _about(f"{{}}: {NOT_TAKEN}")
battery_skipped = _about("{}: not enough battery")
not_served = _about(f"{{}}: {ENDED_BEFORE}")
left_out = _about(f"{{}}: {LEFT_OUT}")
"""Sentences by the name of a place: while driving, after an errand; and why a table was not served."""


def is_failure(skipped_reason: str) -> bool:
    """Return whether the robot, and not a person, is why a table was not served."""
    return not skipped_reason.endswith(BY_PERSONS)


def load(status: DeliveryStatus, trays: int) -> str:
    """Return the message in the kitchen, with the tables to load for, on which tray if there are several."""
    tables = status.queue[: trays or None]
    back = f"{_food_back(status)} " if status.untaken else ""
    if trays < 2:
        return f"In the kitchen. {back}Load the food for {join_names(tables)}, then press 'Loaded'."
    loads = "; ".join(f"tray {number}: {display_name(table)}" for number, table in enumerate(tables, 1))
    return f"In the kitchen. {back}Load {loads}. Then press 'Loaded'."


def unload(status: DeliveryStatus) -> str:
    """Return the message in the kitchen at the end of a round, with the tables whose food nobody took."""
    return f"In the kitchen. {_food_back(status)} Then press 'Unloaded'."


def _food_back(status: DeliveryStatus) -> str:
    return f"Unload the food for {join_names(status.untaken)} that nobody took."


def take(status: DeliveryStatus) -> str:
    """Return the message at a table, with the tray of its food if there are several."""
    return f"{_food_here(status)} Please take it and press 'Taken'."


def for_guest(status: DeliveryStatus) -> str:
    """Return the message for a guest, who has nothing to press."""
    if status.hold_reason == "choice" or status.state == "failed":
        return "The robot waits. Please call the staff."
    if status.state == "waiting":
        return f"{_food_here(status)} Please take it."
    return at(status.place) if status.state in ("loading", "unloading") else status.description


def _food_here(status: DeliveryStatus) -> str:
    trays, place = status.on_trays, status.place
    tray = f" on tray {trays.index(place) + 1}" if place in trays and len(trays) > 1 else ""
    return f"Your food is here{tray}, {display_name(place)}."


def not_reached(place: str, why: str) -> str:
    """Return the message for a place that navigation did not reach."""
    return f"{display_name(place)} was not reached: {why}"


def stopped(status: DeliveryStatus) -> str:
    """Return the message of a round during an emergency stop; the guest at a table may take the food meanwhile."""
    there = status.state in ("loading", "waiting", "unloading")
    place = display_name(status.place)
    where = f"the robot is at {place}" if there else f"{place} is next"
    return f"The emergency stop is active. The round is kept: {where}."


def choose(status: DeliveryStatus, reason: str) -> str:
    """Return the message while the round waits for the operator's choice."""
    if status.state not in ROUND_STATES:
        return f"{reason} {ORDER_WAITS} start with the next order, or cancel it.".strip()
    if status.state == "loading":
        options = (
            f"load the food and press 'Loaded', drive to {display_name(status.place)} again, or end the round"
        )
    elif status.state in ("returning", "unloading") or not status.loaded:
        options = f"go on to {display_name(status.place)}, or end the round"
    else:
        options = f"go on to {display_name(status.place)}, go back to the kitchen, or end the round"
    return f"{reason} {ROUND_WAITS} {options}.".strip()


def served(delivered: Sequence[str], places: Sequence[str]) -> str:
    """Return how a round ended of which some places received their food."""
    if len(delivered) == len(places):
        return "All places were served."
    return f"{len(delivered)} of {number_of(len(places), 'place')} served."


def ended(left: Sequence[str]) -> str:
    """Return the message after a round was ended on request, with the unserved tables."""
    return f"The round was ended; not served: {join_names(left)}." if left else "The round was ended."


def order_cancelled(places: Sequence[str]) -> str:
    """Return the message after a waiting order was cancelled."""
    return f"The order for {join_names(places)} was cancelled." if places else ORDER_CANCELLED


def refused(tables: Sequence[str], reach: float, length: float) -> str:
    """Return the refusal of an order whose route (m) is longer than the battery reaches (m)."""
    return (
        f"{_sentence_start(tables)} refused: the battery has energy for about {reach:.0f} m, "
        f"the round needs {length:.0f} m."
    )


def refused_below(tables: Sequence[str], charge: float) -> str:
    """Return the refusal of an order by a robot that goes home to be charged; charge 0..1."""
    return f"{_sentence_start(tables)} refused: the battery is at {100 * charge:.0f} % and has to be charged."


def _sentence_start(tables: Sequence[str]) -> str:
    text = join_names(tables) or "the place on the map"
    return text[:1].upper() + text[1:]
