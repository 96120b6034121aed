"""What a page asked for reaches a robot that hears only now and then, once and in turn."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.std_msgs import Bool
from chefbot.ui.pending_requests import ORDER_UNCONFIRMED, STOP_UNCONFIRMED, PendingRequests

TICK = 200_000_000
STEPS = st.lists(
    st.sampled_from(["order", "stop", "release", "cancel", "answer", "gone", "back"]), max_size=20
)


class Waiter:
    """Takes orders and STOP where it is there; its answers come when it is asked for them."""

    def __init__(self) -> None:
        self.there, self.stopped, self.taken = True, False, list[Order]()
        self.asked = PendingRequests("page", self.hear_stop, self.hear_order)

    def hear_stop(self, press: Bool) -> None:
        if self.there:
            self.stopped = press.data

    def hear_order(self, order: Order) -> None:
        if self.there and (not self.taken or order.id != self.taken[-1].id):
            self.taken.append(order)

    def answer(self, now_ns: int) -> None:
        if self.stopped:
            self.asked.confirm_stop()
        if self.taken:
            self.asked.confirm_orders([one.id for one in self.taken], now_ns)


@given(STEPS)
def test_every_valid_request_finally_reaches_the_robot(steps: list[str]) -> None:
    waiter, wanted, pressed, now = Waiter(), list[str](), False, 0
    for number, step in enumerate(steps):
        now += TICK
        if step == "order":
            wanted.append(f"table_{number}")
            waiter.asked.deliver((wanted[-1],), now)
        elif step in ("stop", "release"):
            pressed = step == "stop"
            if pressed:
                waiter.asked.press(now, stopped=waiter.stopped)
            else:
                waiter.asked.release()
            assert not pressed or waiter.stopped or waiter.asked.stop or not waiter.there
        elif step == "answer" and waiter.there:
            waiter.answer(now)
        else:
            waiter.there = step != "gone" and (waiter.there or step == "back")
        if step == "cancel":
            waiter.asked.cancel()
            wanted = [order.places[0] for order in waiter.taken]
        waiter.asked.repeat_unconfirmed(now)
    waiter.there = True
    for _ in range(6 * (len(wanted) + 1)):
        now += TICK
        waiter.asked.repeat_unconfirmed(now)
        waiter.answer(now)
    assert [order.places[0] for order in waiter.taken] == wanted
    assert waiter.stopped or not pressed
    assert not waiter.asked.stop and not waiter.asked.order_warning(now)


def test_unconfirmed_requests_are_reported() -> None:
    waiter = Waiter()
    waiter.there = False
    waiter.asked.press(0, stopped=False)
    waiter.asked.deliver(("table_1",), 0)
    assert (waiter.asked.stop_warning(TICK), waiter.asked.order_warning(TICK)) == ("", "")
    assert (waiter.asked.stop_warning(6 * TICK), waiter.asked.order_warning(6 * TICK)) == (
        STOP_UNCONFIRMED,
        ORDER_UNCONFIRMED,
    )
