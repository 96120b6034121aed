"""Which food is on which tray, and the stops of a round that needs several trips from the kitchen.

`trays` is the number of trays, each with the food of one table; 0 for a robot that carries the food of all tables at
once, whose status has no trays.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from chefbot.delivery.round_outcome import OrderError
from chefbot.msgs.chefbot_msgs import DeliveryStatus

BEING_LOADED = "The trays are being loaded for these tables; press 'Loaded' first, then change the round."
LOADED_FIRST = "The tables whose food is on a tray are served first."


def take_from_tray(on_trays: tuple[str, ...], place: str) -> tuple[str, ...]:
    """Return the trays after a place was served, or given up."""
    if place not in on_trays:
        return on_trays
    tray = on_trays.index(place)
    return (*on_trays[:tray], "", *on_trays[tray + 1 :])


def loaded_first(status: DeliveryStatus, queue: Sequence[str]) -> tuple[str, ...]:
    """Return the tables in the same order, but those whose food is on a tray before the others."""
    if not status.on_trays:
        return tuple(queue)
    food, loaded, others = _food_for_queue(status), list[str](), list[str]()
    for table in queue:
        (loaded if food[table] > 0 else others).append(table)
        food[table] -= 1
    return (*loaded, *others)


def resorted(status: DeliveryStatus, queue: Sequence[str], trays: int) -> tuple[str, ...]:
    """Return the queue after a change of it. OrderError where food would go to another table, or nothing changes."""
    if status.state == "loading" and trays > 1 and queue and tuple(queue[:trays]) != status.queue[:trays]:
        raise OrderError(BEING_LOADED)
    changed = loaded_first(status, queue)
    if changed == status.queue != tuple(queue):
        raise OrderError(LOADED_FIRST)
    return changed


def carried(status: DeliveryStatus, queue: Sequence[str]) -> int:
    """Return the number of tables at the front of the queue that are served before the next visit to the kitchen."""
    if not status.loaded or not status.on_trays:
        return len(queue) if status.loaded else 0
    food = _food_for_queue(status)
    for count, table in enumerate(queue):
        if food[table] <= 0:
            return count
        food[table] -= 1
    return len(queue)


def on_board(status: DeliveryStatus, tables: Sequence[str]) -> tuple[str, ...]:
    """Return those of some tables of the queue whose food is on the robot."""
    if not status.loaded or not status.on_trays:
        return tuple(tables) if status.loaded else ()
    return tuple((_food_for_queue(status) & Counter(tables)).elements())


def has_food(status: DeliveryStatus) -> bool:
    """Return whether food is on the robot: for the place that it serves now, for others, or what nobody took."""
    serves = status.loaded and status.state in ("driving", "waiting")
    return serves or bool(status.untaken or on_board(status, status.queue))


def is_going_home(status: DeliveryStatus) -> bool:
    """Return whether the robot drives home with nothing on board that has to go back to the kitchen."""
    return status.state == "returning" and not status.untaken


def trip_is_over(status: DeliveryStatus) -> bool:
    """Return whether the robot has to load again before it can serve the tables that are left."""
    return bool(status.queue) and status.loaded and not carried(status, status.queue)


def stops_left(status: DeliveryStatus, queue: Sequence[str], trays: int, kitchen: str) -> tuple[str, ...]:
    """Return the places that the robot still drives to in its round to serve a queue, without the drive home.

    Food that nobody took goes back to the kitchen at the end, or when the robot loads there again.
    """
    here = (status.place,) if status.state == "driving" else ()
    count = carried(status, queue)
    later = with_kitchen(queue[count:], trays, kitchen)
    if status.loaded:
        food_back = (kitchen,) if status.untaken and not later else ()
        return (*here, *queue[:count], *later, *food_back)
    return (*here, *later[1:])  # it is in the kitchen, or drives there


def with_kitchen(tables: Sequence[str], trays: int, kitchen: str) -> tuple[str, ...]:
    """Return the stops of the trips to these tables: the kitchen, then as many tables as there are trays."""
    size = trays or max(1, len(tables))
    trips = (tables[first : first + size] for first in range(0, len(tables), size))
    return tuple(stop for trip in trips for stop in (kitchen, *trip))


def _food_for_queue(status: DeliveryStatus) -> Counter[str]:
    """Return the food on the trays for other tables than the current one."""
    food = Counter(status.on_trays)
    if status.state in ("driving", "waiting"):
        food[status.place] -= 1
    return food
