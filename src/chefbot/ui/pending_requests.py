"""What the operator asked for and the robot has not confirmed yet: it is said again until it does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence

from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.std_msgs import Bool
from chefbot.ui.stop_requests import Presses

ANSWER_NS = 1_000_000_000
"""A robot that has not answered after so long may not have heard it."""
ORDER_PERIOD_NS = 1_000_000_000
UNANSWERED = "Nobody has taken the order yet; it is said again until somebody does."
UNCONFIRMED = "STOP was pressed, but the robot does not confirm it. Use the switch on the robot."


class Asked:
    """STOP and orders may be lost on the way, or with a process that is just being started again.

    To take a STOP back is said once: what comes late must not release one that was pressed since. Orders are said one
    after the other, each until its `id` comes back, so that none is lost and none is served twice. A device says
    things in its own time only: what tells it news says nothing.
    """

    def __init__(
        self, name: str, say_stop: Callable[[Bool], None], say_order: Callable[[Order], None]
    ) -> None:
        self._name, self._say_stop, self._say_order = name, say_stop, say_order
        self.presses = Presses()
        self._pressed_ns = 0
        self._orders: deque[Order] = deque()
        self._first_ns = self._said_ns = 0

    @property
    def stop(self) -> bool:
        """Whether a STOP waits to be confirmed."""
        return self.presses.waiting

    def press(self, now_ns: int, *, stopped: bool, key: str = "") -> None:
        """STOP was pressed; the robot says that it is `stopped` already, or not. A copy of a press is no new one."""
        was_waiting = self.stop
        if not self.presses.press(key, stopped=stopped):
            return
        if not was_waiting:
            self._pressed_ns = now_ns
        self._say_stop(Bool(True))

    def release(self) -> None:
        """STOP was released."""
        self.presses.clear()
        self._say_stop(Bool(False))

    def stop_is_known(self) -> None:
        """The robot says that it is stopped."""
        self.presses.latched()

    def again(self, now_ns: int) -> None:
        """Say what nobody has confirmed: a STOP whenever this is called, an order once in a while."""
        if self.stop:
            self._say_stop(Bool(True))
        if self._orders and now_ns - self._said_ns >= ORDER_PERIOD_NS:
            self._say_first(now_ns)

    def why(self, now_ns: int) -> str:
        """What people should know of a STOP that nobody confirms; empty while there is hope."""
        return UNCONFIRMED if self.stop and now_ns - self._pressed_ns > ANSWER_NS else ""

    def deliver(self, tables: Sequence[str], now_ns: int) -> None:
        """An order, behind those that nobody has taken yet."""
        self._orders.append(Order(tuple(tables), f"{self._name} {now_ns}"))
        if len(self._orders) == 1:
            self._first_ns = now_ns
            self._say_first(now_ns)

    def order_is_known(self, accepted: Collection[str], now_ns: int) -> None:
        """The waiter has accepted those of these ids; the next is said by `again`."""
        if self._orders and self._orders[0].id in accepted:
            self._orders.popleft()
            self._first_ns, self._said_ns = now_ns, now_ns - ORDER_PERIOD_NS

    def cancel(self) -> None:
        """No orders any more."""
        self._orders.clear()

    def order_step(self, now_ns: int) -> str:
        """What people should know of an order that nobody takes; empty while there is hope."""
        return UNANSWERED if self._orders and now_ns - self._first_ns > ANSWER_NS else ""

    def _say_first(self, now_ns: int) -> None:
        self._said_ns = now_ns
        self._say_order(self._orders[0])
