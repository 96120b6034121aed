"""Tests that requests of the web UI reach a robot with an intermittent connection once and in order."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.std_msgs import Bool
from chefbot.ui.pending_requests import ORDER_UNCONFIRMED, STOP_UNCONFIRMED, PendingRequests

TICK = 200_000_000
STEPS = st.lists(
    st.sampled_from(["order", "stop", "release", "cancel", "answer", "disconnect", "reconnect"]), max_size=20
)


class IntermittentRobot:
    """A robot that receives orders and stop requests while it is connected, and confirms them by `answer`."""

    def __init__(self) -> None:
        self.connected, self.stopped, self.accepted = True, False, list[Order]()
        self.requests = PendingRequests("page", self.on_stop_request, self.on_order)

    def on_stop_request(self, press: Bool) -> None:
        if self.connected:
            self.stopped = press.data

    def on_order(self, order: Order) -> None:
        if self.connected and (not self.accepted or order.id != self.accepted[-1].id):
            self.accepted.append(order)

    def answer(self, now_ns: int) -> None:
        if self.stopped:
            self.requests.confirm_stop()
        if self.accepted:
            self.requests.confirm_orders([order.id for order in self.accepted], now_ns)


@given(STEPS)
def test_every_valid_request_eventually_reaches_the_robot(steps: list[str]) -> None:
    robot, expected, pressed, now = IntermittentRobot(), list[str](), False, 0
    for number, step in enumerate(steps):
        now += TICK
        if step == "order":
            expected.append(f"table_{number}")
            robot.requests.deliver((expected[-1],), now)
        elif step in ("stop", "release"):
            pressed = step == "stop"
            if pressed:
                robot.requests.press(now, stopped=robot.stopped)
            else:
                robot.requests.release()
            assert not pressed or robot.stopped or robot.requests.stop or not robot.connected
        elif step == "answer" and robot.connected:
            robot.answer(now)
        else:
            robot.connected = step != "disconnect" and (robot.connected or step == "reconnect")
        if step == "cancel":
            robot.requests.cancel()
            expected = [order.places[0] for order in robot.accepted]
        robot.requests.repeat_unconfirmed(now)
    robot.connected = True
    for _ in range(6 * (len(expected) + 1)):
        now += TICK
        robot.requests.repeat_unconfirmed(now)
        robot.answer(now)
    assert [order.places[0] for order in robot.accepted] == expected
    assert robot.stopped or not pressed
    assert not robot.requests.stop and not robot.requests.order_warning(now)


def test_two_orders_of_one_moment_are_both_served() -> None:
    robot = IntermittentRobot()
    for person in ("anna", "ben"):
        robot.requests.deliver((f"table_of_{person}",), TICK, person)
    for second in range(1, 6):
        robot.answer(second * 10 * TICK)
        robot.requests.repeat_unconfirmed(second * 10 * TICK)
    assert [order.ordered_by for order in robot.accepted] == ["anna", "ben"]


def test_unconfirmed_requests_are_reported() -> None:
    robot = IntermittentRobot()
    robot.connected = False
    robot.requests.press(0, stopped=False)
    robot.requests.deliver(("table_1",), 0)
    assert (robot.requests.stop_warning(TICK), robot.requests.order_warning(TICK)) == ("", "")
    assert (robot.requests.stop_warning(6 * TICK), robot.requests.order_warning(6 * TICK)) == (
        STOP_UNCONFIRMED,
        ORDER_UNCONFIRMED,
    )
