"""Records delivery rounds in the history, from the statuses that the delivery node publishes."""

from __future__ import annotations

from chefbot.delivery.status_messages import ROUND_STATES, display_name
from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.storage.delivery_history import DeliveryHistory

TAKEN = "taken"
NOT_SERVED = "not served"


class RoundRecorder:
    """Notes the beginning, the steps and the end of each round; raises StorageError if that cannot be written."""

    def __init__(self, history: DeliveryHistory, *, simulated: bool) -> None:
        self._history, self._simulated = history, simulated
        self._number: int | None = None
        self._key: tuple[str, tuple[str, ...]] = ("", ())
        self._taken = self._missed = 0

    def process(self, status: DeliveryStatus) -> bool:
        """Note what has changed since the last status, and return whether the history has."""
        if (
            status.state not in ROUND_STATES or not status.places
        ):  # without places it drives home to be charged
            return self._end(status.last_outcome)
        began = self._number is None or self._key != (status.order_id, status.places)
        if began:
            self._begin(status)
        return self._note_steps(status) or began

    def _begin(self, status: DeliveryStatus) -> None:
        """Begin a round, or go on with one that was recorded before a restart of this process."""
        self._end(status.last_outcome)
        history, places = self._history, status.places
        self._key = (status.order_id, places)
        self._number = history.open_round(status.order_id, places)
        if self._number is None:
            person, simulated = status.ordered_by, self._simulated
            self._number = history.begin(status.order_id, person, places, simulated=simulated)
        (newest,) = history.rounds(1)
        outcomes = [stop.outcome for stop in newest.stops]
        self._taken = outcomes.count(TAKEN)
        self._missed = len(status.skipped_reasons) if any(outcomes) else 0

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
        for place in self._key[1]:
            self._history.note_stop(self._number, place, NOT_SERVED)
        self._history.end(self._number, sentence)
        self._number = None
        return True


def _place_of(reason: str, places: tuple[str, ...]) -> str:
    """Return the place that a reason begins with, empty if it is none of these."""
    named = [place for place in places if reason.startswith(display_name(place))]
    return max(named, key=len, default="")
