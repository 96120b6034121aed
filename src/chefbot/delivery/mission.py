"""A round of deliveries: kitchen, tables, home. People move it on; STOP and errands hold it. No clock, no loop.

`DeliveryStatus` is the whole state, so that a restarted process continues from what was published last. Food counts
as delivered when a person presses "Taken" (or when the owner has set a timer that does it), never by driving on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from chefbot.delivery import sentences
from chefbot.delivery.sentences import IN_ROUND
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order
from chefbot.msgs.geometry_msgs import PoseStamped

UNKNOWN_PLACE, NOT_REACHED, ENDED_BY_PERSON = 1, 2, 3
"""Error codes of an outcome."""
REMEMBERED = 16
"""How many accepted orders are known by their id, so that a repeated request is not served again."""
Resolve = Callable[[tuple[str, ...]], tuple[str, ...]]


class Leg(NamedTuple):
    """Where the robot shall drive now: a place by name, or a pose. A new number is a new drive."""

    number: int
    place: str
    pose: PoseStamped | None


class Outcome(NamedTuple):
    """How an order ended; code 0 if everything was taken."""

    order_id: str
    delivered: tuple[str, ...]
    code: int
    sentence: str


class Round:
    """All deliveries. Every method is an event; `status` and `leg` are what follows from it.

    `resolve` turns the places of an order into names on the map; it raises UserError for an unknown one.
    """

    def __init__(self, kitchen: str, home: str, resolve: Resolve, on_end: Callable[[Outcome], None]) -> None:
        self.kitchen, self.home = kitchen, home
        self.status = DeliveryStatus(state="idle", sentence=sentences.WAITING)
        self.stopped = False
        self._resolve, self._on_end = resolve, on_end
        self.number = 0
        """Of drives so far."""

    @property
    def leg(self) -> Leg | None:
        """Where to drive; None: stand."""
        now = self.status
        if now.held == "errand" or (now.state == "errand" and not now.held):
            return Leg(self.number, now.errands[0].name, now.errands[0].pose)
        driving = not now.held and now.state in ("driving", "returning")
        return Leg(self.number, now.place, None) if driving else None

    @property
    def in_hand(self) -> bool:
        """Whether there is a round that has not ended."""
        return self.status.state in IN_ROUND

    # -- orders

    def order(self, order: Order) -> None:
        """Accept it once; it begins when nothing else is in hand."""
        if order.id and order.id in self.status.accepted:
            return
        accepted = (*self.status.accepted, order.id)[-REMEMBERED:] if order.id else self.status.accepted
        self._set(orders=(*self.status.orders, order), accepted=accepted)
        if self.stopped and not self.in_hand:
            self._set(held="stop", sentence=sentences.ORDER_KEPT)
        self._begin_next()

    def resume(self, told: DeliveryStatus) -> None:
        """Continue from the state of a process that died: what was under way is driven again."""
        self.status = told
        if not told.held:
            self._set_out_again()

    def cancel(self) -> None:
        """Give up the round, the orders behind it, and errands."""
        before = self.status
        if not (self.in_hand or before.orders or before.errands):
            return
        many = len(before.orders)
        self._set(orders=(), errands=(), held="")
        self._stand("idle", sentences.CANCELLED_TOO.format(many) if many else sentences.CANCELLED)
        if before.state in IN_ROUND:
            self._on_end(Outcome(before.order_id, before.delivered, ENDED_BY_PERSON, sentences.CANCELLED))
        for order in before.orders:
            self._on_end(Outcome(order.id, (), ENDED_BY_PERSON, sentences.CANCELLED))

    def withdraw(self, order_id: str) -> None:
        """Give up the order of this id, in hand or waiting."""
        if self.in_hand and self.status.order_id == order_id:
            self._end_round(sentences.CANCELLED)
        else:
            self._set(orders=tuple(one for one in self.status.orders if one.id != order_id))

    # -- what people at the robot say

    def loaded(self) -> None:
        """The food is on the tray."""
        if self.status.state == "loading":
            self._set(loaded=True)
            self._next()

    def taken(self) -> None:
        """The guest has the food."""
        if self.status.state == "waiting":
            self._set(delivered=(*self.status.delivered, self.status.place))
            self._next()

    def skip(self) -> None:
        """Nobody takes the food: on to the next place."""
        if self.status.state == "waiting":
            self._miss(sentences.not_taken(self.status.place))
            self._next()

    # -- STOP and errands, and what people choose after them

    def stop(self, pressed: bool) -> None:
        """STOP keeps the round; released, the round waits for a person's choice."""
        self.stopped = pressed
        if pressed:
            self._forget_drive()
            if self.in_hand or self.status.orders:
                self._set(held="stop", sentence=self._kept())
        elif self.status.held == "stop":
            self._ask("STOP is released.")

    def diverted(self) -> None:
        """Somebody else sent the robot elsewhere: it is no longer where it was, or on its way."""
        asks = self.status.held in ("", "errand")
        self._forget_drive()
        self._leave()
        if asks and (self.in_hand or self.status.orders):
            self._ask(sentences.DIVERTED)

    def go(self, errand: Errand) -> None:
        """Drive somewhere else: now (the round waits), after the round, or instead of it.

        UserError while STOP is pressed, and when there is a round and `when` does not say how they go together.
        """
        if self.stopped and not (self.in_hand and errand.when == "after"):
            raise UserError(sentences.NOT_WHILE_STOPPED)
        if self.in_hand and errand.when not in ("now", "after", "instead"):
            raise UserError(sentences.SAY_WHEN)
        if self.in_hand and errand.when == "after":
            self._set(errands=(*self.status.errands, errand))
        elif self.status.held or (self.in_hand and errand.when == "now"):
            self._go_now(errand)
        else:
            self._go_instead(errand)

    def choose(self, choice: str) -> None:
        """What a round that waits shall do: go_on, kitchen or end. UserError while STOP is pressed."""
        if self.stopped:
            raise UserError(sentences.NOT_WHILE_STOPPED)
        if choice == "go_on" and self.status.held:
            self._forget_drive()
            self._set(held="")
            self._set_out_again()
            self._begin_next()
        elif choice == "kitchen" and self.status.state in ("loading", "driving", "waiting"):
            self._back_to_kitchen()
        elif choice == "end" and self.in_hand:
            self._end_round(sentences.ended(self._left()))
        elif choice == "end" and self.status.held:
            self._drop_next_order()

    def arrived(self, fault: str = "") -> None:
        """The drive of `leg` has ended; `fault` says why the place was not reached."""
        leg = self.leg
        if leg is None:
            return
        missed = sentences.not_reached(leg.place, fault) if fault else ""
        if self.status.held == "errand":
            self._forget_drive()
            self._ask(missed or sentences.at(leg.place))
        elif self.status.state == "errand":
            self._set(errands=self.status.errands[1:])
            self._after_round(missed or sentences.at(leg.place), failed=bool(missed))
        else:
            if missed:
                self._miss(missed)
            self._arrive(reached=not missed)

    # -- the parts

    def _arrive(self, *, reached: bool) -> None:
        place = self.status.place
        if self.status.state == "returning":
            self._finish()
        elif not reached:
            self._set(queue=self.status.queue if self.status.loaded else ())
            self._next()
        elif not self.status.loaded:
            self._set(state="loading", sentence=sentences.load(self.status.queue))
        else:
            self._set(state="waiting", sentence=sentences.take(place))

    def _next(self) -> None:
        """To the next table, or home; where an errand follows, the round ends here."""
        if self.status.queue:
            place, *rest = self.status.queue
            self._set(queue=tuple(rest))
            self._drive("driving", place)
        elif self.status.errands and not self.status.held:
            self._finish()
        else:
            self._drive("returning", self.home)

    def _drive(self, state: str, place: str) -> None:
        self.number += 1
        held = self.status.held
        self._set(
            state=state, place=place, sentence=self.status.sentence if held else sentences.on_the_way(place)
        )
        if held:
            self._say_again()

    def _set_out_again(self) -> None:
        """After whatever held it: to where it was going, or where it stood."""
        self.number += 1
        if self.status.state in ("loading", "waiting"):
            self._set(state="driving")
        if self.in_hand:
            self._set(sentence=sentences.on_the_way(self.status.place))

    def _leave(self) -> None:
        """It is no longer at the place where it stood: nobody can load or take there."""
        if self.status.state in ("loading", "waiting"):
            self._set(state="driving")

    def _go_now(self, errand: Errand) -> None:
        self._forget_drive()
        self._leave()
        self.number += 1
        sentence = sentences.on_the_way(errand.name) + sentences.MEANWHILE
        self._set(errands=(errand, *self.status.errands), held="errand", sentence=sentence)

    def _go_instead(self, errand: Errand) -> None:
        if self.in_hand:
            self._drop_round(sentences.ended(self._left()))
        self._set(errands=(errand,))
        self._drive_errand()

    def _drive_errand(self) -> None:
        self._drive("errand", self.status.errands[0].name)

    def _back_to_kitchen(self) -> None:
        """The food goes back, and out again when it is loaded."""
        if self.status.loaded:
            self._set(queue=(self.status.place, *self.status.queue))
        self._forget_drive()
        self._set(held="", loaded=False)
        self._drive("driving", self.kitchen)

    def _forget_drive(self) -> None:
        """The errand in hand ends where the robot is."""
        if self.status.held == "errand":
            self._set(errands=self.status.errands[1:], held="choice")
        elif self.status.state == "errand":
            self._set(errands=())
            self._stand("idle", sentences.ERRAND_ENDED)

    def _ask(self, reason: str) -> None:
        self._set(held="choice", sentence=sentences.choose(self.status, reason))

    def _say_again(self) -> None:
        """A round that is held goes on in thought only: the sentence follows."""
        if self.status.held == "stop":
            self._set(sentence=self._kept())
        elif self.status.held == "choice":
            self._ask("")

    def _kept(self) -> str:
        return sentences.stopped(self.status) if self.in_hand else sentences.ORDER_KEPT

    def _miss(self, sentence: str) -> None:
        self._set(missed=(*self.status.missed, sentence))

    def _left(self) -> tuple[str, ...]:
        """Tables that have not got their food."""
        at_table = self.status.state in ("driving", "waiting") and self.status.loaded
        return (self.status.place, *self.status.queue) if at_table else self.status.queue

    def _finish(self) -> None:
        """All is done that could be done."""
        missed = self.status.missed
        self._close("; ".join(missed), NOT_REACHED if missed else 0)
        self._after_round(missed[0] if missed else sentences.AT_HOME, failed=bool(missed))

    def _end_round(self, sentence: str) -> None:
        """By a person: the robot stands; further orders wait for a choice if the round was held."""
        self._drop_round(sentence)
        self._after_round(sentence, failed=False)

    def _drop_round(self, sentence: str) -> None:
        for table in self._left():
            self._miss(sentences.not_served(table))
        self._close(sentence, ENDED_BY_PERSON)

    def _close(self, sentence: str, code: int) -> None:
        status = self.status
        self._stand("failed" if code == NOT_REACHED else "idle", sentence or sentences.AT_HOME)
        self._on_end(Outcome(status.order_id, status.delivered, code, sentence))

    def _stand(self, state: str, sentence: str) -> None:
        self._set(state=state, place="", queue=(), order_id="", loaded=False, sentence=sentence)

    def _after_round(self, sentence: str, *, failed: bool) -> None:
        """What waits: an errand, an order, or nothing."""
        self._stand("failed" if failed else "idle", sentence)
        if self.status.held:
            if self.status.orders:
                self._ask(sentence)
            else:
                self._set(held="", errands=())
        elif self.status.errands:
            self._drive_errand()
        else:
            self._begin_next()

    def _drop_next_order(self) -> None:
        first, *rest = self.status.orders
        self._set(orders=tuple(rest))
        self._on_end(Outcome(first.id, (), ENDED_BY_PERSON, sentences.ended(first.places)))
        self._after_round(sentences.ended(first.places), failed=False)

    def _begin_next(self) -> None:
        """The orders in turn, as far as they can be served at all."""
        while self.status.orders and not self.status.held and self.status.state in ("idle", "failed"):
            first, *rest = self.status.orders
            self._set(orders=tuple(rest), order_id=first.id, delivered=(), missed=())
            try:
                tables = self._tables(first)
            except UserError as error:
                self._stand("failed", str(error))
                self._on_end(Outcome(first.id, (), UNKNOWN_PLACE, str(error)))
            else:
                self._set(queue=tables)
                self._drive("driving", self.kitchen)

    def _tables(self, order: Order) -> tuple[str, ...]:
        if not order.places:
            raise UserError(sentences.NO_PLACE)
        try:
            return self._resolve(order.places)
        except UserError as error:
            raise UserError(f"On this map {error}.") from None

    def _set(self, **changes: Any) -> None:
        self.status = msgspec.structs.replace(self.status, **changes)
