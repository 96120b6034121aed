"""Places and errands of delivery rounds in tests."""

from __future__ import annotations

from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import Errand
from chefbot.msgs.geometry_msgs import PoseStamped

TABLES = ("table_1", "table_2", "table_3", "kitchen")


def errand(when: str) -> Errand:
    return Errand("reception", PoseStamped(), when)


def resolve(places: tuple[str, ...]) -> tuple[str, ...]:
    for place in places:
        if place not in TABLES:
            raise UserError(f"there is no place called {place!r}")
    return places
