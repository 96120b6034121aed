"""Requests of the operator that the robot has not confirmed yet; they are repeated until it does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence

from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.std_msgs import Bool
from chefbot.ui.stop_requests import StopPresses

CONFIRMATION_TIMEOUT_NS = 1_000_000_000
"""Timeout of a confirmation, ns, after which the operator is warned."""
ORDER_PERIOD_NS = 1_000_000_000
"""Period at which an unconfirmed order is repeated, ns."""
ORDER_UNCONFIRMED = "The order is not confirmed yet; it is being repeated."
STOP_UNCONFIRMED = (
    "Emergency stop is not confirmed by the robot. "
    "Press the emergency stop button on the robot or switch the robot off."
)


class PendingRequests:
    """Emergency stops and orders that wait for confirmation, as messages may be lost, or a process may be
    restarting.

    A release is published once: a late copy must not release an emergency stop that was pressed since. Orders
    are published in order, each until its `id` is confirmed, so that none is lost and none is
    served twice. Nothing is published by methods that process a confirmation.
    """

    def __init__(
        self, name: str, publish_stop: Callable[[Bool], None], publish_order: Callable[[Order], None]
    ) -> None:
        self._name, self._publish_stop, self._publish_order = name, publish_stop, publish_order
        self.presses = StopPresses()
        self._pressed_ns = 0
        self._orders: deque[Order] = deque()
        self._queued_ns = self._published_ns = self._ordered_ns = 0

    @property
    def stop(self) -> bool:
        """Whether an emergency stop waits for confirmation."""
        return self.presses.waiting

    def press(self, now_ns: int, *, stopped: bool, key: str = "") -> None:
        """Publish an emergency stop. `stopped`: whether the robot reports it as latched already. A repeated
        press with the same key is ignored."""
        was_waiting = self.stop
        if not self.presses.press(key, stopped=stopped):
            return
        if not was_waiting:
            self._pressed_ns = now_ns
        self._publish_stop(Bool(True))

    def release(self) -> None:
        """Publish the release of the emergency stop."""
        self.presses.clear()
        self._publish_stop(Bool(False))

    def confirm_stop(self) -> None:
        """Process the robot's confirmation that it is stopped."""
        self.presses.latched()

    def repeat_unconfirmed(self, now_ns: int) -> None:
        """Repeat unconfirmed requests: an emergency stop with each call, an order once per period."""
        if self.stop:
            self._publish_stop(Bool(True))
        if self._orders and now_ns - self._published_ns >= ORDER_PERIOD_NS:
            self._publish_first(now_ns)

    def stop_warning(self, now_ns: int) -> str:
        """Return a warning for the operator after the timeout of an emergency stop; empty before."""
        return STOP_UNCONFIRMED if self.stop and now_ns - self._pressed_ns > CONFIRMATION_TIMEOUT_NS else ""

    def deliver(self, tables: Sequence[str], now_ns: int, ordered_by: str = "") -> None:
        """Queue an order behind the unconfirmed ones; two orders of one moment have ids of their own."""
        self._ordered_ns = max(now_ns, self._ordered_ns + 1)
        self._orders.append(Order(tuple(tables), f"{self._name} {self._ordered_ns}", ordered_by))
        if len(self._orders) == 1:
            self._queued_ns = now_ns
            self._publish_first(now_ns)

    def confirm_orders(self, accepted: Collection[str], now_ns: int) -> None:
        """Process the ids of accepted orders; the next order is published by `again`."""
        # Confirmed: let `again` publish the next order at once.
        if self._orders and self._orders[0].id in accepted:
            self._orders.popleft()
            self._queued_ns, self._published_ns = now_ns, now_ns - ORDER_PERIOD_NS

    def cancel(self) -> None:
        """Discard all orders that are not confirmed."""
        self._orders.clear()

    def order_warning(self, now_ns: int) -> str:
        """Return a warning for the operator after the timeout of an order; empty before."""
        return (
            ORDER_UNCONFIRMED if self._orders and now_ns - self._queued_ns > CONFIRMATION_TIMEOUT_NS else ""
        )

    def _publish_first(self, now_ns: int) -> None:
        self._published_ns = now_ns
        self._publish_order(self._orders[0])
