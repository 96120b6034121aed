"""Records delivery rounds in the history, from the statuses that the delivery node publishes."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from chefbot.delivery.status_messages import ORDER_CANCELLED, ROUND_STATES
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order
from chefbot.place_names import display_name
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.delivery_history import DeliveryHistory

TAKEN = "taken"
NOT_SERVED, CANCELLED = "not served", "order cancelled"


class RoundRecorder:
    """Notes orders that wait, and the beginning, the steps and the end of each round.

    `labels` returns the labels of the places that have one.
    """

    def __init__(
        self, history: DeliveryHistory, labels: Callable[[], Mapping[str, str]], *, simulated: bool
    ) -> None:
        self._history, self._labels, self._simulated = history, labels, simulated
        self._number: int | None = None
        self._key: tuple[str, tuple[str, ...]] = ("", ())
        self._taken = self._missed = 0
        self._waiting: dict[str, tuple[int, tuple[str, ...]]] = {}
        """Orders that wait, by their `id`: the numbers of their rounds, and their places."""

    def process(self, status: DeliveryStatus, time: str) -> bool:
        """Note what has changed since the last status at a time (UTC, ISO 8601); return whether the history has.

        Raises StorageError if that cannot be written; then nothing has changed, and it may be tried again.
        """
        before = self._number, self._key, self._taken, self._missed, dict(self._waiting)
        try:
            with self._history.changes_of(time):
                return self._process(status)
        except StorageError:
            self._number, self._key, self._taken, self._missed, self._waiting = before
            raise

    def _process(self, status: DeliveryStatus) -> bool:
        changes = [self._note_waiting(order) for order in status.pending_orders if order.id]
        return any([*changes, self._note_round(status), self._note_dropped(status)])

    def _note_waiting(self, order: Order) -> bool:
        """Note an order that waits, so that a crash does not lose it, or that its places have changed."""
        number, places = self._waiting.get(order.id, (None, ()))
        if places == order.places:
            return False
        if number is None:
            number = self._open_round(order.id, order.ordered_by, order.places)
        else:
            self._history.replace_stops(number, order.places, self._labels())
        self._waiting[order.id] = number, order.places
        return True

    def _note_round(self, status: DeliveryStatus) -> bool:
        # without places it drives home to be charged
        if status.state not in ROUND_STATES or not status.places:
            if self._number is not None and status.places == self._key[1]:
                self._note_steps(status)  # at its last table another order or an errand may follow at once
            return self._end(status.last_outcome)
        began = self._number is None or self._key != (status.order_id, status.places)
        if began:
            self._begin(status)
        return self._note_steps(status) or began

    def _note_dropped(self, status: DeliveryStatus) -> bool:
        """Note the end of the orders that wait no longer and have not become a round."""
        gone = self._waiting.keys() - {order.id for order in status.pending_orders}
        for number, places in [self._waiting.pop(order_id) for order_id in gone]:
            if number != self._number:
                refused = status.state == "failed"
                outcome = (status.description, NOT_SERVED) if refused else (ORDER_CANCELLED, CANCELLED)
                self._close(number, places, *outcome)
        return bool(gone)

    def _begin(self, status: DeliveryStatus) -> None:
        """Begin a round, or go on with one that was recorded while it waited, or before a restart of this process."""
        self._end(status.last_outcome)
        places = status.places
        self._key = (status.order_id, places)
        number, ordered = self._waiting.get(status.order_id, (None, ()))
        if number is None:
            number = self._open_round(status.order_id, status.ordered_by, places)
        elif ordered != places:  # by their labels
            self._history.replace_stops(number, places, self._labels())
        self._number = number
        outcomes = [stop.outcome for stop in self._history.stops(number)]
        self._taken = outcomes.count(TAKEN)
        self._missed = len(status.skipped_reasons) if any(outcomes) else 0

    def _open_round(self, order_id: str, ordered_by: str, places: tuple[str, ...]) -> int:
        """Return the number of the round of an order that has not ended, which begins here unless it is recorded."""
        number = self._history.open_round(order_id, places)
        if number is None:
            labels = self._labels()
            number = self._history.begin(order_id, ordered_by, places, labels, simulated=self._simulated)
        return number

    def _note_steps(self, status: DeliveryStatus) -> bool:
        assert self._number is not None, "a round is under way"
        taken, reasons = status.delivered[self._taken :], status.skipped_reasons[self._missed :]
        self._taken, self._missed = len(status.delivered), len(status.skipped_reasons)
        if status.loaded:
            self._history.note_loaded(self._number)
        for place in taken:
            self._history.note_stop(self._number, place, TAKEN)
        for reason in reasons:
            if place := _place_of(reason, status.places):
                why = reason.removeprefix(display_name(place)).lstrip(": ")
                self._history.note_stop(self._number, place, why)
        return bool(taken or reasons)

    def _end(self, sentence: str) -> bool:
        if self._number is None:
            return False
        self._close(self._number, self._key[1], sentence)
        self._number = None
        return True

    def _close(self, number: int, places: tuple[str, ...], sentence: str, outcome: str = NOT_SERVED) -> None:
        for place in places:
            self._history.note_stop(number, place, outcome)
        self._history.end(number, sentence)


def _place_of(reason: str, places: tuple[str, ...]) -> str:
    """Return the place that a reason begins with, empty if it is none of these."""
    named = [place for place in places if reason.startswith(display_name(place))]
    return max(named, key=len, default="")
