"""The delivery node: loads in the kitchen, delivers to the tables and returns home."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.delivery.drive_retry import RETRY_PERIOD
from chefbot.delivery.round_outcome import OrderOutcome
from chefbot.msgs import chefbot_msgs as msgs
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.std_msgs import Bool, Empty, String
from chefbot.nodes.deliveries.forecast import DeliveryForecastNode
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, restored
from chefbot.safety.emergency_stop import is_pressed, pressed_since


class DeliveryNode(DeliveryForecastNode):
    """Serves `deliver`; also accepts an `order` from the web UI. New orders wait for the current one.

    `delivery_status` contains the complete state that is restored after a restart; the state machine is
    `DeliveryRound`.
    """

    order: In[msgs.Order]
    loaded: In[Empty]
    taken: In[Empty]
    not_taken: In[Empty]
    round_choice: In[String]
    round_queue: In[msgs.Order]
    round_shortest: In[String]
    errand: In[msgs.Errand]
    cancel: In[Empty]
    emergency_stop: In[Bool]
    navigation_goal: In[PoseStamped]
    restored_status: In[msgs.DeliveryStatus] = restored("delivery_status")
    restored_stop: In[msgs.EmergencyStopStatus] = restored("stop_status")
    deliver = action_server(msgs.Deliver)

    def start(self) -> None:
        """Start idle, or continue the round restored after a restart."""
        super().start()
        self._results: dict[str, Future[OrderOutcome]] = {}
        self._goals = 0
        self._feedback: Callable[[msgs.Deliver_Feedback], None] = lambda _: None
        self.spawn(self._restore())

    def on_restored_status(self, restored: msgs.DeliveryStatus) -> None:
        """Restore the round after a restart, before any new message is processed."""
        self._round.resume(restored)

    async def _restore(self) -> None:
        """Continue the restored round, unless the emergency stop was pressed since."""
        await self.sleep(0.0)  # restored messages are delivered first
        restored = self.restored_status.last
        if restored is not None:
            since = pressed_since(self.restored_stop.last, restored.header.stamp.ns)
            self._round.resume_after_stop(
                pressed=is_pressed(self.emergency_stop.last),
                pressed_meanwhile=since or restored.hold_reason == "stop",
            )
        self._publish()
        while self._round.leg is not None and self.places.last is None:
            await self.sleep(RETRY_PERIOD)
        self._ready = True
        self._update_drive()

    def on_order(self, order: msgs.Order) -> None:
        """Accept an order and publish the status even if unchanged, as a repeated request was not acknowledged."""
        self._published_status = None
        is_new = not order.id or order.id not in self._round.status.accepted
        self._round.order(order)
        self._update_drive()
        if is_new:
            self._warn_of_cut_off(order.places)

    def on_loaded(self, _: Empty) -> None:
        """Leave the kitchen: the food is on the tray."""
        self._apply_event(self._round.loaded)

    def on_taken(self, _: Empty) -> None:
        """Count the table as served: the guest has taken the food."""
        self._apply_event(self._round.taken)

    def on_not_taken(self, _: Empty) -> None:
        """Skip the table, where nobody takes the food."""
        self._apply_event(self._round.skip)

    def on_round_choice(self, choice: String) -> None:
        """Process the operator's choice for a waiting round: go_on, kitchen or end."""
        self._apply_event(lambda: self._round.choose(choice.data))

    def on_round_queue(self, order: msgs.Order) -> None:
        """Change the order of the tables of the current round, or leave some out."""
        self._apply_event(lambda: self._round.change_queue(order.id, order.places))

    def on_round_shortest(self, order_id: String) -> None:
        """Put the tables of the round with this id into the order of the shortest route."""
        self._apply_event(lambda: self._shorten_route(order_id.data))

    def on_errand(self, errand: msgs.Errand) -> None:
        """Drive to another place on request of the operator."""
        self._apply_event(lambda: self._round.go(errand))

    def on_cancel(self, _: Empty) -> None:
        """Cancel the round and all orders."""
        self._apply_event(self._round.cancel)

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Hold the round on an emergency stop; nothing resumes by itself after the release."""
        self._apply_event(lambda: self._round.stop(pressed.data))

    def on_navigation_goal(self, _: PoseStamped) -> None:
        """Note that another client's goal moves the robot away, if no drive of this node is active."""
        if self._drive is None:
            self._apply_event(self._round.on_diverted)

    async def on_deliver(
        self, goal: msgs.Deliver_Goal, feedback: Callable[[msgs.Deliver_Feedback], None]
    ) -> msgs.Deliver_Result:
        """Accept an order by action and return its outcome; canceling the goal withdraws the order."""
        self._goals += 1
        order = msgs.Order(goal.places, f"{self.name} {self.now_ns} {self._goals}")
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
        return msgs.Deliver_Result(outcome.delivered, outcome.code, outcome.sentence if outcome.code else "")

    def _report_status(self, status: msgs.DeliveryStatus) -> None:
        """Send feedback of the action goal, if there is one."""
        super()._report_status(status)
        if self.deliver.busy:
            self._feedback(msgs.Deliver_Feedback(status.description))

    def _report_outcome(self, outcome: OrderOutcome) -> None:
        """Publish the status and set the result of the action goal, if the order came by action."""
        super()._report_outcome(outcome)
        self._publish()
        if outcome.order_id in self._results:
            self._results[outcome.order_id].set_result(outcome)
