"""The state of a delivery round: its status, and the small changes that its events are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from chefbot.delivery import status_messages
from chefbot.delivery.round_outcome import ENDED_BY_PERSON, NOT_REACHED, DriveRequest, OrderOutcome
from chefbot.delivery.status_messages import ROUND_STATES
from chefbot.msgs.chefbot_msgs import DeliveryStatus

Resolve = Callable[[tuple[str, ...]], tuple[str, ...]]
"""Converts the places of an order to names on the map; raises a ChefbotError for an unknown one."""


class RoundState:
    """Base class of the delivery state machine."""

    def __init__(
        self, kitchen: str, home: str, resolve: Resolve, on_end: Callable[[OrderOutcome], None]
    ) -> None:
        self.kitchen, self.home = kitchen, home
        self.status = DeliveryStatus(state="idle", description=status_messages.IDLE)
        self.stopped = False
        self.trays = 0
        """Number of trays, each with the food of one table; 0: the food of all tables fits on the robot."""
        self._resolve, self._on_end = resolve, on_end
        self.number = 0
        """Number of drives so far."""

    @property
    def leg(self) -> DriveRequest | None:
        """The current drive, or None to stand still."""
        status = self.status
        if status.hold_reason == "errand" or (status.state == "errand" and not status.hold_reason):
            return DriveRequest(self.number, status.errands[0].name, status.errands[0].pose)
        driving = not status.hold_reason and status.state in ("driving", "returning")
        return DriveRequest(self.number, status.place, None) if driving else None

    @property
    def in_progress(self) -> bool:
        """Whether a round is in progress."""
        return self.status.state in ROUND_STATES

    def _update_status(self, **changes: Any) -> None:
        self.status = msgspec.structs.replace(self.status, **changes)

    def _begin_round(self, order_id: str = "", ordered_by: str = "") -> None:
        """Begin a round without places, or a drive that belongs to no order."""
        nothing: dict[str, Any] = {"places": (), "delivered": (), "skipped_reasons": ()}
        self._update_status(order_id=order_id, ordered_by=ordered_by, **nothing)

    def _set_standing(self, state: str, sentence: str) -> None:
        standing: dict[str, Any] = {"place": "", "queue": (), "order_id": "", "loaded": False, "on_trays": ()}
        self._update_status(state=state, description=sentence, untaken=(), **standing)

    def _drive(self, state: str, place: str) -> None:
        self.number += 1
        held = self.status.hold_reason
        self._update_status(state=state, place=place)
        if not held:
            self._update_status(description=self._on_the_way())
        if held:
            self._update_held_sentence()

    def _leave_place(self) -> None:
        """Note that the robot left its place: food cannot be loaded or taken there."""
        if self.status.state in ("loading", "waiting"):
            self._update_status(state="driving")
        elif self.status.state == "unloading":
            self._update_status(state="returning")

    def _resume_drive(self) -> None:
        """Start the drive to the current place again, after the round was held."""
        self.number += 1
        self._leave_place()
        if self.in_progress:
            self._update_status(description=self._on_the_way())

    def _on_the_way(self) -> str:
        returns_food = self.status.state == "returning" and self.status.untaken
        sentence = status_messages.with_food_back if returns_food else status_messages.on_the_way
        return sentence(self.status.place)

    def _wait_for_choice(self, reason: str) -> None:
        self._update_status(hold_reason="choice", description=status_messages.choose(self.status, reason))

    def _update_held_sentence(self) -> None:
        """Update the sentence of a held round after its state has advanced."""
        if self.status.hold_reason == "stop":
            self._update_status(description=self._held_sentence())
        elif self.status.hold_reason == "choice":
            self._wait_for_choice("")

    def _held_sentence(self) -> str:
        return status_messages.stopped(self.status) if self.in_progress else status_messages.ORDER_KEPT

    def _add_missed(self, sentence: str) -> None:
        self._update_status(skipped_reasons=(*self.status.skipped_reasons, sentence))

    def _keep_food(self, tables: tuple[str, ...]) -> None:
        """Note that nobody took the food of these tables, so that it goes back to the kitchen."""
        self._update_status(untaken=(*self.status.untaken, *tables))

    def _unserved_tables(self) -> tuple[str, ...]:
        """Return the tables that have not received their food."""
        serving = self.status.state in ("driving", "waiting") and self.status.loaded
        return (self.status.place, *self.status.queue) if serving else self.status.queue

    def _drop_round(self, sentence: str) -> None:
        for table in self._unserved_tables():
            self._add_missed(status_messages.not_served(table))
        self._report_round_end(sentence, ENDED_BY_PERSON)

    def _report_round_end(self, sentence: str, code: int) -> None:
        status = self.status
        self._set_standing("failed" if code == NOT_REACHED else "idle", sentence or status_messages.AT_HOME)
        if status.places:  # else it drove home to be charged
            served = status_messages.served(status.delivered, status.places)
            self._update_status(last_outcome=sentence if code == ENDED_BY_PERSON else served)
        self._on_end(OrderOutcome(status.order_id, status.delivered, code, sentence))
