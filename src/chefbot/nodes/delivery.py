"""The waiter: loads in the kitchen, brings food from table to table, comes home."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.delivery.mission import Leg, Outcome, Round
from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import (
    Deliver,
    Deliver_Feedback,
    Deliver_Goal,
    Deliver_Result,
    DeliveryStatus,
    Errand,
    Order,
    Places,
    StopStatus,
)
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal, NavigateToPose_Result
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.runtime.actions import calls, serves
from chefbot.runtime.coroutines import Cancelled, Future, Task
from chefbot.runtime.node import SECOND, In, Node, Out, last_words, topic
from chefbot.safety.emergency_stop import REFUSED, is_pressed, pressed_since
from chefbot.storage.places import find_place

NOBODY_DROVE = 9000
"""Error code UNKNOWN of nav2_msgs/action/NavigateToPose: here, that the navigator died or could not be reached."""
NO_WAY = 208
"""NO_VALID_PATH of nav2_msgs/action/ComputePathToPose: something or somebody stands in the only way."""
WAY_PATIENCE, WAY_PAUSE = 120.0, 10.0
"""Seconds for which a blocked way to the kitchen or home is tried again, and between two tries: a robot that cannot
serve the next table instead has nothing better to do."""
DRIVER_PATIENCE = 120.0
"""Seconds without a navigator after which a place counts as not reached: a crowded computer takes a minute to bring a
process back."""
LOOK_AGAIN = 0.5
"""Seconds between two tries to find what is not there yet."""


class DeliveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where it loads, and timers for owners who want no presses."""

    kitchen: Annotated[str, Meta(min_length=1, description="name of the place where food is loaded")] = (
        "kitchen"
    )
    home: Annotated[str, Meta(min_length=1, description="name of the place to wait for orders")] = "home"
    loading_time: Annotated[
        float,
        Meta(ge=0, le=3600, description="leave the kitchen after so long, s; 0: when 'Loaded' is pressed"),
    ] = 0.0
    taking_time: Annotated[
        float,
        Meta(ge=0, le=3600, description="count food as taken after so long, s; 0: when 'Taken' is pressed"),
    ] = 0.0


class DeliveryNode(Node):
    """Serves `deliver`; also takes an `order` from the page. New orders wait for the one in hand.

    `delivery_status` holds all that its next life needs to go on; what follows on what is `Round`.
    """

    live_params = ("*",)
    params: DeliveryParams
    places: In[Places]
    order: In[Order]
    loaded: In[Empty]
    taken: In[Empty]
    not_taken: In[Empty]
    round_choice: In[String]
    errand: In[Errand]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    navigation_goal: In[PoseStamped]
    told_before: In[DeliveryStatus] = last_words("delivery_status")
    stop_before: In[StopStatus] = last_words("stop_status")
    deliver = serves(Deliver)
    navigate_to_pose = calls(NavigateToPose)
    delivery_status: Out[DeliveryStatus] = topic(latched=True)
    remark: Out[String] = topic("delivery/remark")

    def start(self) -> None:
        """Idle, or on with what a life before had in hand."""
        self._round = Round(self.params.kitchen, self.params.home, self._resolve, self._end)
        self._shown: DeliveryStatus | None = None
        self._ready = False
        self._leg: Leg | None = None
        self._drive: Task[None] | None = None
        self._results: dict[str, Future[Outcome]] = {}
        self._goals = 0
        self._timer: tuple[str, int] | None = None
        self._feedback: Callable[[Deliver_Feedback], None] = lambda _: None
        self.spawn(self._begin())

    def stop(self) -> None:
        """The drive ends with the node; the round does not."""
        self._leg = None
        super().stop()

    def reconfigure(self, params: DeliveryParams) -> None:
        """From the next leg on."""
        self.params = params
        self._round.kitchen, self._round.home = params.kitchen, params.home

    def on_told_before(self, told: DeliveryStatus) -> None:
        """All of it is taken over before anything new comes."""
        self._round.resume(told)

    async def _begin(self) -> None:
        """What a life before had accepted goes on, unless STOP was pressed since."""
        await self.sleep(0.0)  # last words come before
        told = self.told_before.last
        if told is not None:
            pressed = is_pressed(self.emergency_stop.last)
            if pressed or told.held == "stop" or pressed_since(self.stop_before.last, told.header.stamp.ns):
                self._round.stop(True)
                self._round.stop(pressed)
        self._publish()
        while self._round.leg is not None and self.places.last is None:
            await self.sleep(LOOK_AGAIN)
        self._ready = True
        self._follow()

    # -- what is said to it

    def on_order(self, order: Order) -> None:
        """Begin, or put it behind the others; either way it is published, as whoever asks again has not heard it."""
        self._shown = None
        self._round.order(order)
        self._follow()

    def on_loaded(self, _: Empty) -> None:
        """The food is on the tray."""
        self._round.loaded()
        self._follow()

    def on_taken(self, _: Empty) -> None:
        """The guest has the food."""
        self._round.taken()
        self._follow()

    def on_not_taken(self, _: Empty) -> None:
        """Nobody takes it: on to the next table."""
        self._round.skip()
        self._follow()

    def on_round_choice(self, choice: String) -> None:
        """Of a round that waits: go_on, kitchen or end."""
        self._try(lambda: self._round.choose(choice.data))

    def on_errand(self, errand: Errand) -> None:
        """Drive somewhere else."""
        self._try(lambda: self._round.go(errand))

    def on_cancel(self, _: Empty) -> None:
        """Give up all orders."""
        self._round.cancel()
        self._follow()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """The round is kept; nothing starts by itself when the button is released."""
        self._round.stop(pressed.data)
        self._follow()

    def on_navigation_goal(self, _: PoseStamped) -> None:
        """Somebody else's, where none of ours is under way: the robot leaves the place where food is taken."""
        if self._drive is None:
            self._round.diverted()
            self._follow()

    async def on_deliver(
        self, goal: Deliver_Goal, feedback: Callable[[Deliver_Feedback], None]
    ) -> Deliver_Result:
        """An order like any other, with its outcome as the result; who cancels the goal withdraws the order."""
        self._goals += 1
        order = Order(goal.places, f"{self.name} {self.now_ns} {self._goals}")
        result = self._results[order.id] = Future[Outcome]()
        self._feedback = feedback
        self.on_order(order)
        try:
            outcome = await result
        except Cancelled:
            self._round.withdraw(order.id)
            self._follow()
            raise
        finally:
            del self._results[order.id]
        return Deliver_Result(outcome.delivered, outcome.code, outcome.sentence if outcome.code else "")

    # -- what follows on it

    def _try(self, event: Callable[[], None]) -> None:
        """What cannot be done is said to people."""
        try:
            event()
        except UserError as error:
            self.remark.publish(String(str(error)))
        self._follow()

    def _follow(self) -> None:
        """Drive where the round wants the robot, and publish how it stands."""
        self._publish()
        leg = self._round.leg if self._ready else None
        number, under_way = (one.number if one else None for one in (leg, self._leg))
        if number == under_way:
            return
        self._leg, drive = leg, self._drive
        if drive is not None:
            drive.cancel()
        self._drive = self.spawn(self._go(leg)) if leg is not None else None

    async def _go(self, leg: Leg) -> None:
        """Until it is there, cannot get there, or is sent elsewhere."""
        try:
            result = await self._navigate(leg)
        except Cancelled:
            if self._leg is not leg:
                raise  # the round wants something else
            self._round.diverted()
        else:
            if result.error_msg == REFUSED:
                self._round.stop(True)  # the base has published it, and it has not come here yet
            else:
                self._round.arrived(result.error_msg if result.error_code else "")
        self._drive = self._leg = None
        self._follow()

    async def _navigate(self, leg: Leg) -> NavigateToPose_Result:
        """Again, if a navigator has died on the way, or if the way to the kitchen or home is blocked."""
        pose = leg.pose or self._poses().get(leg.place)
        if pose is None:
            await self.sleep(0.0)
            return NavigateToPose_Result(NOBODY_DROVE, f"there is no place called {leg.place!r} on this map")
        failing_since = None
        while True:
            began, result = self.now_ns, await self.navigate_to_pose.call(NavigateToPose_Goal(pose))
            lasted = (self.now_ns - began) / SECOND
            if failing_since is None or (result.error_code == NOBODY_DROVE and lasted > DRIVER_PATIENCE):
                failing_since = self.now_ns  # it was driven until now
            patience = self._patience(leg, result.error_code)
            if self.now_ns >= failing_since + round(patience * SECOND):
                return result
            await self.sleep(WAY_PAUSE if result.error_code == NO_WAY else LOOK_AGAIN)

    def _patience(self, leg: Leg, code: int) -> float:
        """Seconds since the first failure in which a drive that ended so is tried again."""
        if code == NOBODY_DROVE:
            return DRIVER_PATIENCE
        must = leg.place in (self.params.kitchen, self.params.home)
        return WAY_PATIENCE if must and code == NO_WAY else 0.0

    def _watch_timer(self) -> None:
        """Of an owner who wants no presses; it begins again when the robot has come back to the place."""
        status = self._round.status
        times = {"loading": self.params.loading_time, "waiting": self.params.taking_time}
        seconds = 0.0 if status.held else times.get(status.state, 0.0)
        key = (status.state, self._round.number) if seconds else None
        if key != self._timer:
            self._timer = key
            if key is not None:
                self.spawn(self._press_after(seconds, key))

    async def _press_after(self, seconds: float, key: tuple[str, int]) -> None:
        await self.sleep(seconds)
        if self._timer == key:
            (self._round.loaded if key[0] == "loading" else self._round.taken)()
            self._follow()

    def _publish(self) -> None:
        self._watch_timer()
        status = self._round.status
        if status is self._shown:
            return
        self._shown = status
        header = Header.of(self.now_ns, "map")
        self.delivery_status.publish(msgspec.structs.replace(status, header=header))
        if self.deliver.busy:
            self._feedback(Deliver_Feedback(status.sentence))

    def _end(self, outcome: Outcome) -> None:
        """For who asked by action; others see the status, also where another round follows at once."""
        self._publish()
        if outcome.order_id in self._results:
            self._results[outcome.order_id].set(outcome)

    def _resolve(self, wishes: tuple[str, ...]) -> tuple[str, ...]:
        known = self._poses()
        for own in (self.params.kitchen, self.params.home):
            find_place(own, known)
        return tuple(find_place(wish, known) for wish in wishes)

    def _poses(self) -> dict[str, PoseStamped]:
        return {place.name: place.pose for place in self.places.last.places} if self.places.last else {}
