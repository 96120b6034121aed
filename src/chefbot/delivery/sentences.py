"""The sentences of a round, as a person reads them."""

from __future__ import annotations

from collections.abc import Sequence

from chefbot.msgs.chefbot_msgs import DeliveryStatus

WAITING = "Waiting for an order."
AT_HOME = "At home, waiting for an order."
CANCELLED = "The delivery was cancelled."
DIVERTED = "Somebody sent the robot elsewhere."
ORDER_KEPT = "STOP is pressed. The order is kept; press Resume, then choose whether to begin."
NOT_WHILE_STOPPED = "STOP is pressed. Press Resume first."
CANCELLED_TOO = "The delivery was cancelled, and {} more that waited."
ERRAND_ENDED = "The drive was ended."
NO_PLACE = "The order names no place."
MEANWHILE = " The round waits."
SAY_WHEN = "a round is under way; say when to drive there: now, after it, or instead of it"
IN_ROUND = ("loading", "driving", "waiting", "returning")
"""States of a round; in `errand` the robot drives for a person, with no food."""


def spoken(place: str) -> str:
    """The name of a place without its underscores."""
    return place.replace("_", " ")


def listed(places: Sequence[str]) -> str:
    """Several places in a sentence."""
    *most, last = map(spoken, places)
    return f"{', '.join(most)} and {last}" if most else last


def on_the_way(place: str) -> str:
    """While driving."""
    return f"On the way to {spoken(place) or 'the place on the map'}."


def at(place: str) -> str:
    """After an errand."""
    return f"At {spoken(place) or 'the place on the map'}."


def load(tables: Sequence[str]) -> str:
    """In the kitchen, with what is to be loaded."""
    return f"In the kitchen. Load the food for {listed(tables)}, then press 'Loaded'."


def take(table: str) -> str:
    """At a table."""
    return f"Your food is here, {spoken(table)}. Please take it and press 'Taken'."


def not_reached(place: str, why: str) -> str:
    """A place that navigation gave up."""
    return f"{spoken(place)} was not reached: {why}"


def not_taken(table: str) -> str:
    """A table where nobody took the food."""
    return f"{spoken(table)}: nobody took the food"


def not_served(table: str) -> str:
    """A table of a round that a person ended."""
    return f"{spoken(table)}: the round was ended before it was served"


def stopped(status: DeliveryStatus) -> str:
    """While STOP is pressed."""
    return f"STOP is pressed. The round is kept: {spoken(status.place)} is next."


def choose(status: DeliveryStatus, reason: str) -> str:
    """While the round waits for a person."""
    if status.state not in IN_ROUND:
        options = "begin with the next order, or drop it"
    elif status.state == "returning":
        options = f"go on to {spoken(status.place)}, or end the round"
    else:
        options = f"go on to {spoken(status.place)}, go back to the kitchen, or end the round"
    return f"{reason} The round waits. Choose: {options}.".strip()


def ended(left: Sequence[str]) -> str:
    """After a person ended the round; what was left."""
    return f"The round was ended; not served: {listed(left)}." if left else "The round was ended."
