"""The delivery node: loads in the kitchen, delivers to the tables and returns home."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
from msgspec import Meta

from chefbot.delivery.mission import DeliveryRound, DriveRequest, OrderError, OrderOutcome
from chefbot.msgs.chefbot_msgs import (
    Deliver,
    Deliver_Feedback,
    Deliver_Goal,
    Deliver_Result,
    DeliveryStatus,
    EmergencyStopStatus,
    Errand,
    Order,
    Places,
)
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal, NavigateToPose_Result
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled, Future, Task
from chefbot.runtime.node import SECOND, In, Node, Out, restored, topic
from chefbot.safety.emergency_stop import REFUSED, is_pressed, pressed_since
from chefbot.storage.places import find_place

NO_NAVIGATOR = 9000
"""Error code UNKNOWN of nav2_msgs/action/NavigateToPose; here: the navigator died or is not available."""
NO_VALID_PATH = 208
"""NO_VALID_PATH of nav2_msgs/action/ComputePathToPose: an obstacle or a person blocks the only path."""
BLOCKED_PATH_TIMEOUT, BLOCKED_RETRY_PERIOD = 120.0, 10.0
"""Time for which a blocked path to the kitchen or home is retried, and period of the retries, s.

A blocked table is skipped instead, because the robot can serve the next one."""
NAVIGATOR_TIMEOUT = 120.0
"""Time without a navigator after which a place counts as not reached, s: restarting a process may take a minute on a
busy computer."""
RETRY_PERIOD = 0.5
"""Retry period while the places or the navigator are not available, s."""


class DeliveryParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Names of kitchen and home, and timers that replace the buttons."""

    kitchen: Annotated[str, Meta(min_length=1, description="name of the place where food is loaded")] = (
        "kitchen"
    )
    home: Annotated[str, Meta(min_length=1, description="name of the place to wait for orders")] = "home"
    loading_time: Annotated[
        float,
        Meta(ge=0, le=3600, description="loading timeout, s; 0: wait for 'Loaded'"),
    ] = 0.0
    taking_time: Annotated[
        float,
        Meta(ge=0, le=3600, description="pickup timeout, s; 0: wait for 'Taken'"),
    ] = 0.0


class DeliveryNode(Node):
    """Serves `deliver`; also accepts an `order` from the web UI. New orders wait for the current one.

    `delivery_status` contains the complete state that is restored after a restart; `Round` is the state machine.
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
    restored_status: In[DeliveryStatus] = restored("delivery_status")
    restored_stop: In[EmergencyStopStatus] = restored("stop_status")
    deliver = action_server(Deliver)
    navigate_to_pose = action_client(NavigateToPose)
    delivery_status: Out[DeliveryStatus] = topic(latched=True)
    remark: Out[String] = topic("delivery/remark")

    def start(self) -> None:
        """Start idle, or continue the round restored after a restart."""
        self._round = DeliveryRound(
            self.params.kitchen, self.params.home, self._resolve, self._report_outcome
        )
        self._published_status: DeliveryStatus | None = None
        self._ready = False
        self._leg: DriveRequest | None = None
        self._drive: Task[None] | None = None
        self._results: dict[str, Future[OrderOutcome]] = {}
        self._goals = 0
        self._timer: tuple[str, int] | None = None
        self._feedback: Callable[[Deliver_Feedback], None] = lambda _: None
        self.spawn(self._restore())

    def stop(self) -> None:
        """Cancel the drive when the node stops; the round is kept in the status."""
        self._leg = None
        super().stop()

    def reconfigure(self, params: DeliveryParams) -> None:
        """Apply new parameters from the next leg on."""
        self.params = params
        self._round.kitchen, self._round.home = params.kitchen, params.home

    def on_restored_status(self, restored: DeliveryStatus) -> None:
        """Restore the round after a restart, before any new message is processed."""
        self._round.resume(restored)

    async def _restore(self) -> None:
        """Continue the restored round, unless the emergency stop was pressed since."""
        await self.sleep(0.0)  # restored messages are delivered first
        restored = self.restored_status.last
        if restored is not None:
            pressed = is_pressed(self.emergency_stop.last)
            if (
                pressed
                or restored.hold_reason == "stop"
                or pressed_since(self.restored_stop.last, restored.header.stamp.ns)
            ):
                self._round.stop(True)
                self._round.stop(pressed)
        self._publish()
        while self._round.leg is not None and self.places.last is None:
            await self.sleep(RETRY_PERIOD)
        self._ready = True
        self._update_drive()

    # -- subscriptions

    def on_order(self, order: Order) -> None:
        """Accept an order and publish the status even if unchanged, as a repeated request was not acknowledged."""
        self._published_status = None
        self._round.order(order)
        self._update_drive()

    def on_loaded(self, _: Empty) -> None:
        """Leave the kitchen: the food is on the tray."""
        self._round.loaded()
        self._update_drive()

    def on_taken(self, _: Empty) -> None:
        """Count the table as served: the guest has taken the food."""
        self._round.taken()
        self._update_drive()

    def on_not_taken(self, _: Empty) -> None:
        """Skip the table, where nobody takes the food."""
        self._round.skip()
        self._update_drive()

    def on_round_choice(self, choice: String) -> None:
        """Process the operator's choice for a waiting round: go_on, kitchen or end."""
        self._apply_event(lambda: self._round.choose(choice.data))

    def on_errand(self, errand: Errand) -> None:
        """Drive to another place on request of the operator."""
        self._apply_event(lambda: self._round.go(errand))

    def on_cancel(self, _: Empty) -> None:
        """Cancel the round and all orders."""
        self._round.cancel()
        self._update_drive()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Hold the round on an emergency stop; nothing resumes by itself after the release."""
        self._round.stop(pressed.data)
        self._update_drive()

    def on_navigation_goal(self, _: PoseStamped) -> None:
        """Note that another client's goal moves the robot away, if no drive of this node is active."""
        if self._drive is None:
            self._round.on_diverted()
            self._update_drive()

    async def on_deliver(
        self, goal: Deliver_Goal, feedback: Callable[[Deliver_Feedback], None]
    ) -> Deliver_Result:
        """Accept an order by action and return its outcome; canceling the goal withdraws the order."""
        self._goals += 1
        order = Order(goal.places, f"{self.name} {self.now_ns} {self._goals}")
        result = self._results[order.id] = Future[OrderOutcome]()
        self._feedback = feedback
        self.on_order(order)
        try:
            outcome = await result
        except Cancelled:
            self._round.withdraw(order.id)
            self._update_drive()
            raise
        finally:
            del self._results[order.id]
        return Deliver_Result(outcome.delivered, outcome.code, outcome.sentence if outcome.code else "")

    # -- driving and publishing

    def _apply_event(self, event: Callable[[], None]) -> None:
        """Apply an event to the round and publish a remark if it is refused."""
        try:
            event()
        except OrderError as error:
            self.remark.publish(String(str(error)))
        self._update_drive()

    def _update_drive(self) -> None:
        """Publish the status and start, replace or cancel the drive according to the round's leg."""
        self._publish()
        leg = self._round.leg if self._ready else None
        requested, current = (each.number if each else None for each in (leg, self._leg))
        if requested == current:
            return
        self._leg, running = leg, self._drive
        if running is not None:
            running.cancel()
        self._drive = self.spawn(self._drive_leg(leg)) if leg is not None else None

    async def _drive_leg(self, leg: DriveRequest) -> None:
        """Drive a leg until it is reached, fails or is preempted."""
        try:
            result = await self._navigate(leg)
        except Cancelled:
            if self._leg is not leg:
                raise  # cancelled because the round has another leg
            self._round.on_diverted()
        else:
            if result.error_msg == REFUSED:
                self._round.stop(True)  # the emergency stop message has not arrived here yet
            else:
                self._round.arrived(result.error_msg if result.error_code else "")
        self._drive = self._leg = None
        self._update_drive()

    async def _navigate(self, leg: DriveRequest) -> NavigateToPose_Result:
        """Navigate, and retry if the navigator died or the path to the kitchen or home is blocked."""
        pose = leg.pose or self._poses().get(leg.place)
        if pose is None:
            await self.sleep(0.0)
            return NavigateToPose_Result(NO_NAVIGATOR, f"there is no place called {leg.place!r} on this map")
        failing_since = None
        while True:
            start_ns, result = self.now_ns, await self.navigate_to_pose.call(NavigateToPose_Goal(pose))
            duration = (self.now_ns - start_ns) / SECOND
            if failing_since is None or (result.error_code == NO_NAVIGATOR and duration > NAVIGATOR_TIMEOUT):
                failing_since = self.now_ns  # the drive was active until now
            patience = self._retry_time(leg, result.error_code)
            if self.now_ns >= failing_since + round(patience * SECOND):
                return result
            await self.sleep(BLOCKED_RETRY_PERIOD if result.error_code == NO_VALID_PATH else RETRY_PERIOD)

    def _retry_time(self, leg: DriveRequest, code: int) -> float:
        """Return the time (s) since the first failure for which a drive with this error code is retried."""
        if code == NO_NAVIGATOR:
            return NAVIGATOR_TIMEOUT
        required = leg.place in (self.params.kitchen, self.params.home)
        return BLOCKED_PATH_TIMEOUT if required and code == NO_VALID_PATH else 0.0

    def _update_timer(self) -> None:
        """Start the timer that replaces a button; it restarts when the robot returns to the place."""
        status = self._round.status
        times = {"loading": self.params.loading_time, "waiting": self.params.taking_time}
        seconds = 0.0 if status.hold_reason else times.get(status.state, 0.0)
        key = (status.state, self._round.number) if seconds else None
        if key != self._timer:
            self._timer = key
            if key is not None:
                self.spawn(self._press_after(seconds, key))

    async def _press_after(self, seconds: float, key: tuple[str, int]) -> None:
        await self.sleep(seconds)
        if self._timer == key:
            (self._round.loaded if key[0] == "loading" else self._round.taken)()
            self._update_drive()

    def _publish(self) -> None:
        self._update_timer()
        status = self._round.status
        if status is self._published_status:
            return
        self._published_status = status
        header = Header.of(self.now_ns, "map")
        self.delivery_status.publish(msgspec.structs.replace(status, header=header))
        if self.deliver.busy:
            self._feedback(Deliver_Feedback(status.description))

    def _report_outcome(self, outcome: OrderOutcome) -> None:
        """Publish the status and set the result of the action goal, if the order came by action."""
        self._publish()
        if outcome.order_id in self._results:
            self._results[outcome.order_id].set_result(outcome)

    def _resolve(self, names: tuple[str, ...]) -> tuple[str, ...]:
        places = self._poses()
        for place in (self.params.kitchen, self.params.home):
            find_place(place, places)
        return tuple(find_place(name, places) for name in names)

    def _poses(self) -> dict[str, PoseStamped]:
        return {place.name: place.pose for place in self.places.last.places} if self.places.last else {}
