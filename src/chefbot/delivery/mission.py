"""State machine of a delivery round: kitchen, tables, home. Pure logic without a clock or an event loop.

Events from people move the round on; the emergency stop and errands hold it. `DeliveryStatus` is the complete state,
so that a restarted process continues from the last message. Food counts as delivered when a person presses "Taken"
(or a timer set by the owner does), never by driving on. Food that nobody took goes back to the kitchen.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import msgspec

from chefbot.delivery import status_messages
from chefbot.delivery.round_outcome import ENDED_BY_PERSON, NOT_REACHED, OrderError, OrderOutcome
from chefbot.delivery.round_state import RoundState
from chefbot.delivery.status_messages import IDLE_STATES, ROUND_STATES
from chefbot.delivery.trays import (
    has_food,
    is_going_home,
    on_board,
    resorted,
    take_from_tray,
    trip_is_over,
)
from chefbot.errors import ChefbotError
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order

MAX_ACCEPTED_IDS = 16
"""Number of accepted order ids kept, so that a repeated request is not served again."""


class DeliveryRound(RoundState):
    """The delivery state machine: every method is an event, `status` and `leg` are the outputs.

    `resolve` converts the places of an order to names on the map and raises a ChefbotError for an unknown one.
    """

    # -- orders

    def order(self, order: Order) -> None:
        """Accept an order once per id; it starts when no other round is in progress."""
        if order.id and order.id in self.status.accepted:
            return
        accepted = (*self.status.accepted, order.id)[-MAX_ACCEPTED_IDS:] if order.id else self.status.accepted
        self._update_status(pending_orders=(*self.status.pending_orders, order), accepted=accepted)
        if self.stopped and not self.in_progress:
            self._update_status(hold_reason="stop", description=status_messages.ORDER_KEPT)
        if not self._replace_drive_home():
            self._start_next_order()

    def resume(self, restored: DeliveryStatus) -> None:
        """Continue from the state restored after a restart; an interrupted drive starts again."""
        self.status = restored
        if not restored.hold_reason:
            self._resume_drive()

    def resume_after_stop(self, *, pressed: bool, pressed_meanwhile: bool) -> None:
        """Hold the restored round if the emergency stop is pressed, or was at some time since its last message."""
        if pressed or pressed_meanwhile:
            self.stop(True)
            self.stop(pressed)

    def cancel(self) -> None:
        """Cancel the round, the waiting orders and the errands."""
        previous = self.status
        if not (self.in_progress or previous.pending_orders or previous.errands):
            return
        waiting_orders = len(previous.pending_orders)
        self._update_status(pending_orders=(), errands=(), hold_reason="")
        cancelled = status_messages.CANCELLED
        text = status_messages.CANCELLED_TOO.format(waiting_orders) if waiting_orders else cancelled
        if has_food(previous):
            text = f"{text} {status_messages.FOOD_LEFT}"
        self._set_standing("idle", text)
        if previous.state in ROUND_STATES:
            self._update_status(last_outcome=cancelled)
            self._on_end(OrderOutcome(previous.order_id, previous.delivered, ENDED_BY_PERSON, cancelled))
        for order in previous.pending_orders:
            self._on_end(OrderOutcome(order.id, (), ENDED_BY_PERSON, cancelled))

    def withdraw(self, order_id: str) -> None:
        """Cancel the order with this id, in progress or waiting."""
        if self.in_progress and self.status.order_id == order_id:
            self._end_round(status_messages.CANCELLED)
        else:
            self._drop_waiting_order(order_id, status_messages.CANCELLED)

    # -- buttons at the robot

    def loaded(self) -> None:
        """Start the deliveries: the food is on the tray. It is the choice to go on, too, after an emergency stop."""
        if self.status.state == "loading":
            if self.status.hold_reason == "choice":
                self._update_status(hold_reason="")
            self._update_status(loaded=True, on_trays=self.status.queue[: self.trays], untaken=())
            self._go_to_next_place()

    def taken(self) -> None:
        """Count the table as served: the guest has taken the food; in the kitchen it is what nobody took."""
        if self.status.state == "waiting":
            self._update_status(delivered=(*self.status.delivered, self.status.place))
            self._leave_table()
        elif self.status.state == "unloading":
            self._update_status(untaken=())
            self._go_to_next_place()

    def skip(self) -> None:
        """Skip the table, where nobody takes the food, and continue to the next place."""
        if self.status.state == "waiting":
            self._add_missed(status_messages.not_taken(self.status.place))
            self._keep_food((self.status.place,))
            self._leave_table()

    # -- emergency stop, errands, and the operator's choice after them

    def stop(self, pressed: bool) -> None:
        """Hold the round on an emergency stop; after the release it waits for the operator's choice."""
        self.stopped = pressed
        if pressed:
            self._drop_current_errand()
            if self.in_progress or self.status.pending_orders:
                self._update_status(hold_reason="stop", description=self._held_sentence())
        elif self.status.hold_reason == "stop":
            self._wait_for_choice("The emergency stop is released.")

    def on_diverted(self) -> None:
        """Note that another client sent the robot elsewhere, so that it is not at its place or on its way."""
        wait_for_choice = self.status.hold_reason in ("", "errand")
        self._drop_current_errand()
        self._leave_place()
        if wait_for_choice and (self.in_progress or self.status.pending_orders):
            self._wait_for_choice(status_messages.DIVERTED)

    def go(self, errand: Errand) -> None:
        """Start an errand: now (the round waits), after the round, or instead of it.

        Raises OrderError during an emergency stop, and if a round is in progress and `when` is none of these.
        """
        if self.stopped and not (self.in_progress and errand.when == "after"):
            raise OrderError(status_messages.NOT_WHILE_STOPPED)
        if self.in_progress and errand.when not in ("now", "after", "instead"):
            raise OrderError(status_messages.ERRAND_NEEDS_WHEN)
        if self.in_progress and errand.when == "after":
            self._update_status(errands=(*self.status.errands, errand))
        elif self.status.hold_reason or (self.in_progress and errand.when == "now"):
            self._go_now(errand)
        else:
            self._go_instead(errand)

    def choose(self, choice: str) -> None:
        """Apply the operator's choice for a waiting round: go_on, kitchen or end.

        Raises OrderError during an emergency stop.
        """
        if self.stopped:
            raise OrderError(status_messages.NOT_WHILE_STOPPED)
        if choice == "go_on" and self.status.hold_reason:
            self._drop_current_errand()
            self._update_status(hold_reason="")
            if not self._replace_drive_home():
                self._resume_drive()
                self._start_next_order()
        elif choice == "kitchen" and self.status.state in ("loading", "driving", "waiting"):
            self._back_to_kitchen()
        elif choice == "end" and self.in_progress:
            self._end_round(status_messages.ended(self._unserved_tables()))
        elif choice == "end" and self.status.hold_reason:
            self._drop_next_order()

    def change_queue(self, order_id: str, places: Sequence[str]) -> None:
        """Serve the tables after the current one in this order, and leave out those that are missing in it.

        The id may be that of a waiting order, which is cancelled if no table is left. Raises OrderError if the order
        does not have these tables to serve: the operator saw an older state.
        """
        if order_id and order_id in [waiting.id for waiting in self.status.pending_orders]:
            self._change_waiting_order(order_id, tuple(places))
            return
        left, wanted = Counter(self.status.queue), Counter(places)
        if not self.in_progress or order_id != self.status.order_id or wanted - left:
            is_over = bool(order_id) and not places
            raise OrderError(status_messages.ORDER_ENDED if is_over else status_messages.QUEUE_CHANGED)
        queue, left_out = resorted(self.status, places, self.trays), tuple((left - wanted).elements())
        for place in left_out:
            self._add_missed(status_messages.left_out(place))
        self._keep_food(on_board(self.status, left_out))
        self._update_status(queue=queue)
        if not places and not self.status.loaded:
            self._end_round(status_messages.NOTHING_LEFT)
        elif self.status.hold_reason:
            self._update_held_sentence()
        elif self.status.state == "loading":
            self._update_status(description=status_messages.load(self.status, self.trays))

    def arrived(self, failure_reason: str = "") -> None:
        """Process the end of the drive of `leg`; `failure_reason` is empty if the place was reached."""
        leg = self.leg
        if leg is None:
            return
        missed = status_messages.not_reached(leg.place, failure_reason) if failure_reason else ""
        if self.status.hold_reason == "errand":
            self._drop_current_errand()
            self._wait_for_choice(missed or status_messages.at(leg.place))
        elif self.status.state == "errand":
            self._update_status(errands=self.status.errands[1:])
            self._start_waiting_work(missed or status_messages.at(leg.place), failed=bool(missed))
        else:
            if missed:
                self._add_missed(missed)
            self._handle_arrival(reached=not missed)

    # -- transitions

    def _handle_arrival(self, *, reached: bool) -> None:
        if self.status.state == "returning":
            self._handle_return(reached=reached)
        elif not reached:
            if self.status.loaded:
                self._keep_food((self.status.place,))
            else:
                self._update_status(queue=())
            self._leave_table()
        elif not self.status.loaded:
            self._update_status(state="loading", description=status_messages.load(self.status, self.trays))
        else:
            self._update_status(state="waiting", description=status_messages.take(self.status))

    def _handle_return(self, *, reached: bool) -> None:
        """Wait in the kitchen until the food is unloaded, go home if it was not reached, or end the round at home."""
        if not self.status.untaken:
            self._complete_round()
        elif reached:
            self._update_status(state="unloading", description=status_messages.unload(self.status))
        else:
            self._update_status(untaken=())
            self._go_to_next_place()

    def _leave_table(self) -> None:
        place = self.status.place
        self._go_to_next_place()
        self._update_status(on_trays=take_from_tray(self.status.on_trays, place))

    def _go_to_next_place(self) -> None:
        """Drive to the next table, to the kitchen with what is on board or to load again, or home.

        If an errand or an order waits the round ends here.
        """
        if trip_is_over(self.status):
            self._update_status(loaded=False, on_trays=())
            self._drive("driving", self.kitchen)
        elif self.status.queue:
            place, *rest = self.status.queue
            self._update_status(queue=tuple(rest))
            self._drive("driving", place)
        elif self.status.untaken:
            self._drive("returning", self.kitchen)
        elif (self.status.errands and not self.status.hold_reason) or self._order_follows():
            self._complete_round()
        else:
            self._drive("returning", self.home)

    def _replace_drive_home(self) -> bool:
        """Begin the next order in place of the drive home, and return whether there was one to begin."""
        if is_going_home(self.status) and self._order_follows():
            self._complete_round()
            return True
        return False

    def _order_follows(self) -> bool:
        """Return whether a waiting order can begin where the robot is; one that would be refused is left for home."""
        if self.status.hold_reason == "errand" or not (self.status.pending_orders and self.status.loaded):
            return False
        try:
            self._tables(self.status.pending_orders[0])
        except OrderError:
            return False
        return True

    def _go_now(self, errand: Errand) -> None:
        self._drop_current_errand()
        self._leave_place()
        self.number += 1
        sentence = status_messages.on_the_way(errand.name) + status_messages.MEANWHILE
        self._update_status(
            errands=(errand, *self.status.errands), hold_reason="errand", description=sentence
        )

    def _go_instead(self, errand: Errand) -> None:
        if self.in_progress:
            self._drop_round(status_messages.ended(self._unserved_tables()))
        self._update_status(errands=(errand,))
        self._drive_errand()

    def _drive_errand(self) -> None:
        self._drive("errand", self.status.errands[0].name)

    def _back_to_kitchen(self) -> None:
        """Return the food to the kitchen, and deliver it again once it is loaded."""
        if self.status.loaded:
            self._update_status(queue=(self.status.place, *self.status.queue))
        self._drop_current_errand()
        self._update_status(hold_reason="", loaded=False, on_trays=())
        self._drive("driving", self.kitchen)

    def _drop_current_errand(self) -> None:
        """End the current errand where the robot is."""
        if self.status.hold_reason == "errand":
            self._update_status(errands=self.status.errands[1:], hold_reason="choice")
        elif self.status.state == "errand":
            self._update_status(errands=())
            self._set_standing("idle", status_messages.ERRAND_ENDED)

    def _complete_round(self) -> None:
        """End the round and report its outcome."""
        missed = self.status.skipped_reasons
        self._report_round_end("; ".join(missed), NOT_REACHED if missed else 0)
        self._start_waiting_work(missed[0] if missed else status_messages.AT_HOME, failed=bool(missed))

    def _end_round(self, sentence: str) -> None:
        """End the round on request; the robot stands, and waiting orders need a choice if the round was held."""
        self._drop_round(sentence)
        self._start_waiting_work(sentence, failed=False)

    def _start_waiting_work(self, sentence: str, *, failed: bool) -> None:
        """Start what is waiting: an errand, an order, or nothing."""
        self._set_standing("failed" if failed else "idle", sentence)
        if self.status.hold_reason:
            if self.status.pending_orders:
                self._hold_next_order(sentence)
            else:
                self._update_status(hold_reason="", errands=())
        elif self.status.errands:
            self._drive_errand()
        else:
            self._start_next_order()

    def _hold_next_order(self, sentence: str) -> None:
        """Keep the next order until the emergency stop is released, or a person chooses to start it."""
        if self.status.hold_reason == "stop":
            self._update_status(description=status_messages.ORDER_KEPT)
        else:
            self._wait_for_choice(sentence)

    def _drop_next_order(self) -> None:
        first, *rest = self.status.pending_orders
        self._begin_round()
        self._update_status(pending_orders=tuple(rest))
        sentence = status_messages.order_cancelled(first.places)
        self._on_end(OrderOutcome(first.id, (), ENDED_BY_PERSON, sentence))
        self._start_waiting_work(sentence, failed=False)

    def _change_waiting_order(self, order_id: str, places: tuple[str, ...]) -> None:
        """Replace the tables of a waiting order by these, which are some of them; without one it is cancelled."""
        (order,) = (waiting for waiting in self.status.pending_orders if waiting.id == order_id)
        if Counter(places) - Counter(order.places):
            raise OrderError(status_messages.QUEUE_CHANGED)
        if not places:
            self._drop_waiting_order(order_id, status_messages.CANCELLED)
            self._on_end(OrderOutcome(order_id, (), ENDED_BY_PERSON, status_messages.CANCELLED))
            return
        changed = msgspec.structs.replace(order, places=places)
        orders = (changed if waiting is order else waiting for waiting in self.status.pending_orders)
        self._update_status(pending_orders=tuple(orders))

    def _drop_waiting_order(self, order_id: str, sentence: str) -> None:
        """Drop a waiting order; a robot that was held for nothing else waits for an order again."""
        kept = tuple(waiting for waiting in self.status.pending_orders if waiting.id != order_id)
        self._update_status(pending_orders=kept)
        if not kept and self.status.hold_reason and self.status.state in IDLE_STATES:
            self._start_waiting_work(sentence, failed=False)

    def _start_next_order(self) -> None:
        """Start the next order; orders with unknown places fail at once, and an errand follows the last of them."""
        while self.status.pending_orders and not self.status.hold_reason and self.status.state in IDLE_STATES:
            first, *rest = self.status.pending_orders
            self._begin_round(first.id, first.ordered_by)
            self._update_status(pending_orders=tuple(rest))
            try:
                tables = self._tables(first)
            except OrderError as error:
                self._set_standing("failed", str(error))
                self._on_end(OrderOutcome(first.id, (), error.code, str(error)))
            else:
                self._update_status(places=tables, queue=tables)
                self._drive("driving", self.kitchen)
        if self.status.errands and not self.status.hold_reason and self.status.state in IDLE_STATES:
            self._drive_errand()

    def _tables(self, order: Order) -> tuple[str, ...]:
        if not order.places:
            raise OrderError(status_messages.NO_PLACE)
        try:
            return self._resolve(order.places)
        except ChefbotError as error:
            raise OrderError(f"On this map {error}.") from None
