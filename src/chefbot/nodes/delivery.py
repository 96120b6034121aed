"""The waiter: loads in the kitchen, brings food from table to table, comes home."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.msgs.chefbot_msgs import (
    Deliver,
    Deliver_Feedback,
    Deliver_Goal,
    Deliver_Result,
    DeliveryStatus,
    Order,
    Places,
)
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.runtime.actions import calls, serves
from chefbot.runtime.node import SECOND, In, Node, Out, last_words, topic
from chefbot.runtime.tasks import Cancelled, Future, first_of

UNKNOWN_PLACE, NOT_REACHED = 1, 2
"""Error codes of the result."""
NOBODY_DROVE = 9000
"""Error code UNKNOWN of nav2_msgs/action/NavigateToPose: here, that the navigator died or could not be reached."""
DRIVER_PATIENCE = 30.0
"""Seconds without a navigator after which a place counts as not reached."""
LOOK_AGAIN = 0.5
"""Seconds between two tries to find what is not there yet."""


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
    """Serves `deliver`; also takes an `order` from the page. New orders wait for the one in hand."""

    live_params = ("*",)
    params: DeliveryParams
    places: In[Places]
    order: In[Order]
    taken: In[Empty]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    told_before: In[DeliveryStatus] = last_words("delivery_status")
    deliver = serves(Deliver)
    own_order = calls(Deliver, "deliver")
    navigate_to_pose = calls(NavigateToPose)
    delivery_status: Out[DeliveryStatus] = topic(latched=True)

    def start(self) -> None:
        """Idle, or on with what a life before had in hand."""
        self._waiting_orders: list[Order] = []
        self._hand: Future[None] | None = None
        self._queue: tuple[str, ...] = ()
        self._delivered: list[str] = []
        self._missed: list[str] = []
        self._feedback: Callable[[Deliver_Feedback], None] = lambda _: None
        self._resumed: DeliveryStatus | None = None
        self.spawn(self._begin())

    async def _begin(self) -> None:
        await self.sleep(0.0)  # last words come before
        told = self.told_before.last
        if told is None or told.state in ("idle", "failed"):
            self._tell("idle", "", "Waiting for an order.")
            return
        while self.places.last is None:
            await self.sleep(LOOK_AGAIN)
        self._resumed = told
        left = (
            (told.place, *told.queue) if self._is_loaded(told) and told.state != "returning" else told.queue
        )
        await self.own_order.call(Deliver_Goal(left))

    def _is_loaded(self, told: DeliveryStatus) -> bool:
        return told.state != "loading" and told.place != self.params.kitchen

    def on_order(self, order: Order) -> None:
        """Begin, or put it behind the others."""
        self._waiting_orders.append(order)
        if not self.deliver.busy:
            self.spawn(self._work_off())

    async def _work_off(self) -> None:
        while self._waiting_orders:
            await self.own_order.call(Deliver_Goal(self._waiting_orders.pop(0).places))

    def on_taken(self, _: Empty) -> None:
        """The guest has the food."""
        if self._hand is not None:
            self._hand.set(None)

    def on_cancel(self, _: Empty) -> None:
        """Give up all orders."""
        self._waiting_orders.clear()
        self.deliver.preempt()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """The orders end; nothing starts by itself when the button is released."""
        if pressed.data:
            self._waiting_orders.clear()
            self.deliver.preempt()

    async def on_deliver(
        self, goal: Deliver_Goal, feedback: Callable[[Deliver_Feedback], None]
    ) -> Deliver_Result:
        """Kitchen, then each table, then home; a table that cannot be reached is told and passed over."""
        known = self._poses()
        missing = [
            name for name in (*goal.places, self.params.kitchen, self.params.home) if name not in known
        ]
        if missing:
            sentence = f"There is no place called {missing[0]} on this map."
            self._tell("failed", missing[0], sentence)
            return Deliver_Result((), UNKNOWN_PLACE, sentence)
        self._feedback = feedback
        told, self._resumed = self._resumed, None
        self._queue, self._delivered, self._missed = goal.places, [], []
        if told is not None:
            self._delivered += told.delivered
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
        header = Header.of(self.now_ns, "map")
        status = DeliveryStatus(header, state, place, self._queue, tuple(self._delivered), sentence)
        self.delivery_status.publish(status)
        if self.deliver.busy:
            self._feedback(Deliver_Feedback(sentence))


def _spoken(place: str) -> str:
    return place.replace("_", " ")
