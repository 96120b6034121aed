"""The history of a robot's delivery rounds: who ordered what and when, and what became of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path

import msgspec

from chefbot.storage.history_file import HistoryFile

NO_LABELS: Mapping[str, str] = {}


class RecordedStop(msgspec.Struct, frozen=True):
    """One place of a round; times are UTC in ISO 8601."""

    place: str
    outcome: str
    """taken, or why the food was not; empty as long as it is open."""
    at: str | None
    label: str = ""
    """What the place was called by its label then; empty if it had none."""


class RecordedRound(msgspec.Struct, frozen=True):
    """One round; times are UTC in ISO 8601."""

    ordered_by: str
    """Name or role of the person; empty for another program."""
    simulated: bool
    began: str
    loaded: str | None
    ended: str | None
    """None while it is under way, or if the robot was switched off meanwhile."""
    outcome: str
    """How it ended, in a sentence."""
    stops: tuple[RecordedStop, ...]


class DeliveryHistory(HistoryFile):
    """Reads and writes the delivery rounds of a history."""

    def begin(
        self,
        order_id: str,
        ordered_by: str,
        places: Sequence[str],
        labels: Mapping[str, str] = NO_LABELS,
        *,
        simulated: bool,
    ) -> int:
        """Add a round with these places, which have these labels, and return its number."""
        with self._transaction():
            row = self._db.execute(
                "INSERT INTO rounds (order_id, ordered_by, simulated, began) VALUES (?, ?, ?, ?)",
                (order_id, ordered_by, simulated, self._now()),
            )
            number = int(row.lastrowid or 0)
            self._add_stops(number, places, labels)
        return number

    def replace_stops(
        self, number: int, places: Sequence[str], labels: Mapping[str, str] = NO_LABELS
    ) -> None:
        """Replace the places of a round that has not begun."""
        with self._transaction():
            self._db.execute("DELETE FROM stops WHERE round = ?", (number,))
            self._add_stops(number, places, labels)

    def _add_stops(self, number: int, places: Sequence[str], labels: Mapping[str, str]) -> None:
        self._db.executemany(
            "INSERT INTO stops (round, position, place, label) VALUES (?, ?, ?, ?)",
            [(number, position, place, labels.get(place, "")) for position, place in enumerate(places)],
        )

    def open_round(self, order_id: str, places: Sequence[str]) -> int | None:
        """Return the number of the newest round of this order and these places that has not ended, else None.

        Without an id only the newest of all rounds may be the same: an older one was left unfinished by a crash.
        """
        with self._errors_reported():
            newest = self._db.execute(
                "SELECT id FROM rounds WHERE order_id = ? AND ended IS NULL "
                "AND (order_id != '' OR id = (SELECT max(id) FROM rounds)) ORDER BY id DESC LIMIT 1",
                (order_id,),
            ).fetchone()
        same = newest is not None and [stop.place for stop in self.stops(newest[0])] == list(places)
        return int(newest[0]) if same else None

    def stops(self, number: int) -> tuple[RecordedStop, ...]:
        """Return the stops of a round."""
        with self._errors_reported():
            rows = self._db.execute(
                "SELECT place, outcome, at, label FROM stops WHERE round = ? ORDER BY position", (number,)
            )
            return tuple(RecordedStop(*row) for row in rows)

    def note_loaded(self, number: int) -> None:
        """Note that the food of a round is on the tray; only the first time counts."""
        with self._transaction():
            self._db.execute(
                "UPDATE rounds SET loaded = ? WHERE id = ? AND loaded IS NULL", (self._now(), number)
            )

    def note_stop(self, number: int, place: str, outcome: str) -> None:
        """Note the outcome of the first open stop of a round at this place."""
        with self._transaction():
            self._db.execute(
                "UPDATE stops SET outcome = ?, at = ? WHERE round = ? AND position = (SELECT min(position) "
                "FROM stops WHERE round = ? AND place = ? AND outcome = '')",
                (outcome, self._now(), number, number, place),
            )

    def end(self, number: int, outcome: str) -> None:
        """Note the end of a round."""
        with self._transaction():
            self._db.execute(
                "UPDATE rounds SET ended = ?, outcome = ? WHERE id = ? AND ended IS NULL",
                (self._now(), outcome, number),
            )

    def rounds(self, last: int) -> list[RecordedRound]:
        """Return the newest `last` rounds, the oldest of them first."""
        with self._errors_reported():
            rows = self._db.execute(
                "SELECT id, ordered_by, simulated, began, loaded, ended, outcome FROM rounds "
                "ORDER BY id DESC LIMIT ?",
                (last,),
            ).fetchall()
            return [self._round(row) for row in reversed(rows)]

    def _round(self, row: tuple[int, str, int, str, str | None, str | None, str]) -> RecordedRound:
        number, ordered_by, simulated, began, loaded, ended, outcome = row
        return RecordedRound(ordered_by, bool(simulated), began, loaded, ended, outcome, self.stops(number))


def read_history(path: Path, last: int) -> list[RecordedRound]:
    """Return the newest rounds of a history, the oldest of them first. Raises StorageError."""
    with closing(DeliveryHistory(path)) as history:
        return history.rounds(last)
