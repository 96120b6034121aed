"""Places and errands of delivery rounds in tests."""

from __future__ import annotations

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.round_outcome import OrderOutcome
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import Errand, Order
from chefbot.msgs.geometry_msgs import PoseStamped

TABLES = ("table_1", "table_2", "table_3", "kitchen")


def errand(when: str) -> Errand:
    return Errand("reception", PoseStamped(), when)


def resolve(places: tuple[str, ...]) -> tuple[str, ...]:
    for place in places:
        if place not in TABLES:
            raise UserError(f"there is no place called {place!r}")
    return places


class Waiter:
    """A round whose outcomes are noted."""

    def __init__(self) -> None:
        self.outcomes: list[OrderOutcome] = []
        self.round = DeliveryRound("kitchen", "home", resolve, self.outcomes.append)

    def at(self, table: str, *orders: tuple[str, ...]) -> Waiter:
        """Waiting there, with further orders behind."""
        for number, tables in enumerate(orders):
            self.round.order(Order(tables, f"order {number}"))
        while (self.round.status.state, self.round.status.place) != ("waiting", table):
            {"driving": self.round.arrived, "loading": self.round.loaded, "waiting": self.round.taken}[
                self.round.status.state
            ]()
        return self

    @property
    def now(self) -> tuple[str, str, str]:
        status = self.round.status
        return status.state, status.place, status.hold_reason
