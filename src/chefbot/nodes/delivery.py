"""The waiter: loads in the kitchen, brings food from table to table, comes home."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import (
    Deliver,
    Deliver_Feedback,
    Deliver_Goal,
    Deliver_Result,
    DeliveryStatus,
    Order,
    Places,
    StopStatus,
)
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.nodes.stopped import REFUSED, is_pressed, pressed_since
from chefbot.runtime.actions import calls, serves
from chefbot.runtime.node import SECOND, In, Node, Out, last_words, topic
from chefbot.runtime.places import find_place
from chefbot.runtime.tasks import Cancelled, Future, first_of

UNKNOWN_PLACE, NOT_REACHED = 1, 2
"""Error codes of the result."""
NOBODY_DROVE = 9000
"""Error code UNKNOWN of nav2_msgs/action/NavigateToPose: here, that the navigator died or could not be reached."""
DRIVER_PATIENCE = 30.0
"""Seconds without a navigator after which a place counts as not reached."""
LOOK_AGAIN = 0.5
"""Seconds between two tries to find what is not there yet."""
IDLE = ("idle", "failed")
"""States in which no order is in hand."""
ENDED = "The orders ended when STOP was pressed."


class DeliveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where it loads and how long it waits."""

    kitchen: Annotated[str, Meta(min_length=1, description="name of the place where food is loaded")] = (
        "kitchen"
    )
    home: Annotated[str, Meta(min_length=1, description="name of the place to wait for orders")] = "home"
    loading_time: Annotated[float, Meta(ge=0, le=3600, description="to load the food, s")] = 3.0
    taking_time: Annotated[
        float, Meta(ge=0, le=3600, description="longest wait for 'taken' at a table, s")
    ] = 10.0


class DeliveryNode(Node):
    """Serves `deliver`; also takes an `order` from the page. New orders wait for the one in hand.

    `delivery_status` holds all that its next life needs to go on: what is in hand, what waits, what was missed.
    """

    live_params = ("*",)
    params: DeliveryParams
    places: In[Places]
    order: In[Order]
    taken: In[Empty]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    told_before: In[DeliveryStatus] = last_words("delivery_status")
    stop_before: In[StopStatus] = last_words("stop_status")
    deliver = serves(Deliver)
    own_order = calls(Deliver, "deliver")
    navigate_to_pose = calls(NavigateToPose)
    delivery_status: Out[DeliveryStatus] = topic(latched=True)

    def start(self) -> None:
        """Idle, or on with what a life before had in hand."""
        self._orders: list[Order] = []
        self._last_order = ""
        self._working = True
        self._is_next = False
        self._now: tuple[str, str, str] = ("idle", "", "Waiting for an order.")
        self._hand: Future[None] | None = None
        self._queue: tuple[str, ...] = ()
        self._delivered: list[str] = []
        self._missed: list[str] = []
        self._feedback: Callable[[Deliver_Feedback], None] = lambda _: None
        self._resumed: DeliveryStatus | None = None
        self.spawn(self._begin())

    def on_told_before(self, told: DeliveryStatus) -> None:
        """All of it is taken over before anything new comes."""
        self._now, self._last_order = (told.state, told.place, told.sentence), told.last_order
        self._queue, self._orders = told.queue, list(told.orders)
        self._delivered, self._missed = list(told.delivered), list(told.missed)
        self._resumed = told if told.state not in IDLE else None

    async def _begin(self) -> None:
        """What a life before had accepted goes on, unless STOP was pressed since."""
        await self.sleep(0.0)  # last words come before
        told = self.told_before.last
        if told is not None and self._is_ended(told):
            self._orders, self._queue, self._resumed = [], (), None
            self._tell("idle", "", ENDED)
        elif self._resumed is None:
            self._tell(*self._now)
        await self._work_off()

    def _is_ended(self, told: DeliveryStatus) -> bool:
        """Nothing starts by itself after a STOP, also where that was released while nobody was here to hear it."""
        at_work = bool(told.state not in IDLE or told.orders)
        pressed = pressed_since(self.stop_before.last, told.header.stamp.ns)
        return at_work and (pressed or is_pressed(self.emergency_stop.last))

    async def _work_off(self) -> None:
        """One order after the other, first what a life before had in hand."""
        self._working = True
        if self._resumed is not None:
            await self._resume(self._resumed)
        while self._orders:
            self._is_next = True
            await self._deliver_own(self._orders[0].places)
        self._working = False

    async def _resume(self, told: DeliveryStatus) -> None:
        while self.places.last is None and self._resumed is not None:
            await self.sleep(LOOK_AGAIN)
        if self._resumed is None:
            return  # it was cancelled meanwhile
        under_way = self._is_loaded(told) and told.state != "returning"
        await self._deliver_own((told.place, *told.queue) if under_way else told.queue)

    async def _deliver_own(self, places: tuple[str, ...]) -> None:
        """Whatever comes of it is told; where somebody's goal by action took its place, that one ends first."""
        await first_of(self.own_order.call(Deliver_Goal(places)))
        while self.deliver.busy:
            await self.sleep(LOOK_AGAIN)

    def _is_loaded(self, told: DeliveryStatus) -> bool:
        return told.state != "loading" and told.place != self.params.kitchen

    def on_order(self, order: Order) -> None:
        """Begin, or put it behind the others; either way it is told."""
        if order.id and order.id == self._last_order:
            self._tell(*self._now)  # who asks again has not heard that it was accepted
            return
        self._last_order = order.id
        if is_pressed(self.emergency_stop.last):
            self._tell("failed", "", REFUSED)
            return
        self._orders.append(order)
        if self._working or self.deliver.busy:
            self._tell(*self._now)
        if not self._working:
            self.spawn(self._work_off())

    def on_taken(self, _: Empty) -> None:
        """The guest has the food."""
        if self._hand is not None:
            self._hand.set(None)

    def on_cancel(self, _: Empty) -> None:
        """Give up all orders."""
        self._give_up("")

    def on_emergency_stop(self, pressed: Bool) -> None:
        """The orders end; nothing starts by itself when the button is released."""
        if pressed.data:
            self._give_up(ENDED)

    def _give_up(self, why: str) -> None:
        waiting, self._orders, self._is_next = len(self._orders), [], False
        self._resumed = None
        self.deliver.preempt()
        if waiting:
            self._tell("idle", "", why or f"The delivery was cancelled, and {waiting} more that waited.")

    async def on_deliver(
        self, goal: Deliver_Goal, feedback: Callable[[Deliver_Feedback], None]
    ) -> Deliver_Result:
        """Kitchen, then each table, then home; a table that cannot be reached is told and passed over."""
        if is_pressed(self.emergency_stop.last):
            self._tell("failed", "", REFUSED)
            return Deliver_Result((), NOT_REACHED, REFUSED)
        if self._is_next:  # from here on it is in hand
            self._orders, self._is_next = self._orders[1:], False
        known = self._poses()
        wishes = (*goal.places, self.params.kitchen, self.params.home)
        try:
            tables = tuple(find_place(wish, known) for wish in wishes)[: len(goal.places)]
        except UserError as error:
            self._tell("failed", "", f"On this map {error}.")
            return Deliver_Result((), UNKNOWN_PLACE, f"On this map {error}.")
        self._feedback = feedback
        told, self._resumed = self._resumed, None
        self._queue = tables
        if told is None:
            self._delivered, self._missed = [], []
        try:
            return await self._round(known, loaded=told is not None and self._is_loaded(told))
        except Cancelled:
            self._tell("idle", "", "The delivery was cancelled.")
            raise

    async def _round(self, known: dict[str, PoseStamped], *, loaded: bool) -> Deliver_Result:
        faults = [] if loaded else await self._load(known)
        while self._queue and not faults:
            table, self._queue = self._queue[0], self._queue[1:]
            missed = await self._drive("driving", table, known)
            if not missed:
                await self._hand_over(table)
            self._missed += missed
        faults += self._missed + await self._drive("returning", self.params.home, known)
        sentence = faults[0] if faults else "At home, waiting for an order."
        self._tell("failed" if faults else "idle", "", sentence)
        return Deliver_Result(tuple(self._delivered), NOT_REACHED if faults else 0, "; ".join(faults))

    async def _load(self, known: dict[str, PoseStamped]) -> list[str]:
        faults = await self._drive("driving", self.params.kitchen, known)
        if not faults:
            self._tell("loading", self.params.kitchen, "Loading in the kitchen.")
            await self.sleep(self.params.loading_time)
        return faults

    async def _drive(self, state: str, place: str, known: dict[str, PoseStamped]) -> list[str]:
        """Go there; what went wrong, in a list of at most one sentence. Again, if a navigator has died on the way."""
        self._tell(state, place, f"On the way to {_spoken(place)}.")
        result = await self.navigate_to_pose.call(NavigateToPose_Goal(known[place]))
        until = self.now_ns + round(DRIVER_PATIENCE * SECOND)
        while result.error_code == NOBODY_DROVE and self.now_ns < until:
            await self.sleep(LOOK_AGAIN)
            result = await self.navigate_to_pose.call(NavigateToPose_Goal(known[place]))
        return [f"{_spoken(place)} was not reached: {result.error_msg}"] if result.error_code else []

    async def _hand_over(self, table: str) -> None:
        """Until somebody says 'taken', or for `taking_time`."""
        self._tell(
            "waiting", table, f"Your food is here, {_spoken(table)}. Please take it and press 'Taken'."
        )
        self._hand = Future()
        await first_of(self._hand, self.sleep(self.params.taking_time))
        self._hand = None
        self._delivered.append(table)

    def _poses(self) -> dict[str, PoseStamped]:
        return {place.name: place.pose for place in self.places.last.places} if self.places.last else {}

    def _tell(self, state: str, place: str, sentence: str) -> None:
        self._now = (state, place, sentence)
        header = Header.of(self.now_ns, "map")
        done, missed, orders = tuple(self._delivered), tuple(self._missed), tuple(self._orders)
        self.delivery_status.publish(
            DeliveryStatus(
                header, *self._now[:2], self._queue, done, sentence, missed, orders, self._last_order
            )
        )
        if self.deliver.busy:
            self._feedback(Deliver_Feedback(sentence))


def _spoken(place: str) -> str:
    return place.replace("_", " ")
