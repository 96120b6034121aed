"""What a delivery round asks for and how it ends: drives, outcomes of orders, refused requests."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.errors import ChefbotError
from chefbot.msgs.geometry_msgs import PoseStamped

UNKNOWN_PLACE, NOT_REACHED, ENDED_BY_PERSON, BATTERY_TOO_LOW = 1, 2, 3, 4
"""Error codes of an outcome."""


class DriveRequest(NamedTuple):
    """A drive to a place by name, or to a pose; each drive has a new number."""

    number: int
    place: str
    pose: PoseStamped | None


class OrderOutcome(NamedTuple):
    """The outcome of an order; code 0 if everything was taken."""

    order_id: str
    delivered: tuple[str, ...]
    code: int
    sentence: str


class OrderError(ChefbotError):
    """An order or request that the round cannot accept in its present state; a sentence for the operator."""

    code = UNKNOWN_PLACE
