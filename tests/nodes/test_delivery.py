"""Tests the delivery node with navigator and base: emergency stop, errands and goals of other clients in a round."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import ROOM, NodeRunner

from chefbot.delivery.status_messages import ORDER_ENDED, QUEUE_CHANGED
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand, Order
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    ComputePathToPose,
    ComputePathToPose_Goal,
    ComputePathToPose_Result,
    FollowPath,
    FollowPath_Goal,
    FollowPath_Result,
)
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Bool, Empty, Header, String
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams
from chefbot.safety.emergency_stop import REFUSED

RECEPTION = 9.0
KINDS = {
    "base": "chefbot.nodes.drive_base:DriveBaseNode",
    "navigator": "chefbot.nodes.navigator:NavigatorNode",
    "delivery": "chefbot.nodes.delivery:DeliveryNode",
    "controller": "tests.nodes.test_delivery:FakeController",
}


class FakeController(Node):
    """Planner and controller that reach each goal after 0.8 s and record it."""

    params: NoParams
    compute_path_to_pose = action_server(ComputePathToPose)
    follow_path = action_server(FollowPath)

    def start(self) -> None:
        self.reached: list[float] = []

    async def on_compute_path_to_pose(self, goal: ComputePathToPose_Goal, _: Any) -> ComputePathToPose_Result:
        return ComputePathToPose_Result(Path(Header(), (goal.goal,)))

    async def on_follow_path(self, goal: FollowPath_Goal, _: Any) -> FollowPath_Result:
        await self.sleep(0.8)
        self.reached.append(goal.path.poses[-1].pose.position.x)
        return FollowPath_Result()


class DeliveryRunner(NodeRunner):
    """The delivery node in a room with a kitchen and two tables."""

    def __init__(self, **delivery: float) -> None:
        super().__init__(KINDS, {}, {"delivery": delivery})
        self.run(0.1)

    def publish(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "client", from_device=True)
        self.run(0.1)

    def until(self, state: str, place: str) -> None:
        """Run until the delivery is in a state, with loading and taking confirmed on the way."""
        for _ in range(100):
            if (self.now.state, self.now.place) == (state, place):
                return
            press = {"loading": "loaded", "waiting": "taken", "unloading": "taken"}.get(self.now.state)
            if press:
                self.publish(press, Empty())
            self.run(0.1)
        raise AssertionError(f"{state} {place} was not reached: {self.now}")

    @property
    def now(self) -> DeliveryStatus:
        status: DeliveryStatus = self.messages("delivery_status")[-1]
        return status

    @property
    def reached(self) -> list[str]:
        controller: Any = self.system.nodes["controller"]
        names = {x: name for name, x in ROOM.items()} | {RECEPTION: "reception"}
        return [names[x] for x in controller.reached]

    def press_stop(self, pressed: bool) -> None:
        self.publish("stop_request", Bool(pressed))


def pose(x: float) -> PoseStamped:
    return PoseStamped(Header.of(0, "map"), Pose.of(SE2(x, 0.0, 0.0)))


def errand(when: str) -> Errand:
    return Errand("reception", pose(RECEPTION), when)


def start_orders(*orders: tuple[str, ...], **delivery: float) -> DeliveryRunner:
    runner = DeliveryRunner(**delivery)
    for number, tables in enumerate(orders):
        runner.publish("order", Order(tables, str(number)))
    return runner


@pytest.mark.slow
def test_robot_waits_for_confirmation_in_kitchen_and_at_table() -> None:
    runner = start_orders(("table_1",))
    runner.run(600.0)
    assert (runner.now.state, runner.reached) == ("loading", ["kitchen"])
    runner.publish("loaded", Empty())
    runner.run(600.0)
    assert (runner.now.state, runner.now.delivered, runner.reached) == ("waiting", (), ["kitchen", "table_1"])
    runner.publish("taken", Empty())
    runner.run(60.0)
    assert (runner.now.state, runner.now.delivered) == ("idle", ("table_1",))


def test_configured_timers_replace_confirmations() -> None:
    runner = start_orders(("table_1",), loading_timeout=3.0, pickup_timeout=10.0)
    runner.run(60.0)
    assert (runner.now.state, runner.now.delivered) == ("idle", ("table_1",))


def test_timers_pause_during_emergency_stop() -> None:
    runner = start_orders(("table_1",), loading_timeout=3.0, pickup_timeout=10.0)
    runner.run(5.0)
    assert runner.now.state == "waiting"
    runner.press_stop(True)
    runner.run(60.0)
    assert (runner.now.state, runner.now.delivered) == ("waiting", ())


@pytest.mark.parametrize("source", ["other client", "now"])
def test_an_errand_on_the_way_to_a_table_keeps_the_orders(source: str) -> None:
    runner = start_orders(("table_1", "table_2"), ("table_2",))
    runner.until("driving", "table_1")
    runner.publish("goal_pose", pose(RECEPTION)) if source == "other client" else runner.publish(
        "errand", errand("now")
    )
    runner.run(5.0)
    assert runner.reached[-1] == "reception" and runner.now.hold_reason == "choice"
    assert (runner.now.place, runner.now.queue, len(runner.now.pending_orders)) == (
        "table_1",
        ("table_2",),
        1,
    )
    runner.publish("round_choice", String("go_on"))
    runner.until("idle", "")
    assert runner.reached[2:] == ["table_1", "table_2", "kitchen", "table_2", "home"]
    assert not runner.now.skipped_reasons


def test_food_is_not_ordered_to_the_kitchen() -> None:
    runner = start_orders(("table_1", "kitchen"))
    runner.until("failed", "")
    assert runner.now.description.startswith(
        "On this map the food comes from kitchen; order it to another place."
    )
    assert runner.reached == []


def test_an_order_that_cannot_begin_is_a_notice() -> None:
    """Its person waits; the next order begins in the same moment."""
    runner = start_orders(("table_1",), ("roof",), ("table_2",))
    runner.until("waiting", "table_2")
    (notice,) = runner.messages("delivery/notice")
    assert "roof" in notice.data


def test_a_changed_queue_is_driven_unless_it_is_outdated() -> None:
    runner = start_orders(("table_1", "table_2", "table_1"))
    runner.until("driving", "table_1")
    runner.publish("round_queue", Order(("table_1", "table_1"), runner.now.order_id))
    runner.publish("round_queue", Order(("table_2",), "another round"))
    runner.publish("round_queue", Order((), "another round"))
    runner.run(0.5)
    assert runner.now.queue == ("table_2", "table_1"), "none was possible"
    notices = [one.data for one in runner.messages("delivery/notice")]
    assert notices == [QUEUE_CHANGED, QUEUE_CHANGED, ORDER_ENDED]
    runner.publish("round_queue", Order(("table_1",), runner.now.order_id))
    runner.until("failed", "")
    assert runner.reached == ["kitchen", "table_1", "table_1", "kitchen", "home"]
    assert runner.now.skipped_reasons == ("table 2: it was taken out of the round",)


@pytest.mark.parametrize("source", ["other client", "now"])
def test_an_errand_with_food_on_board_is_completed(source: str) -> None:
    runner = start_orders(("table_1",))
    runner.until("loading", "kitchen")
    runner.publish("goal_pose", pose(RECEPTION)) if source == "other client" else runner.publish(
        "errand", errand("now")
    )
    runner.publish("loaded", Empty())
    runner.run(60.0)
    assert runner.reached == ["kitchen", "reception"] and runner.now.hold_reason == "choice"
    runner.publish("round_choice", String("go_on"))
    runner.run(5.0)
    assert (runner.now.state, runner.reached[-1]) == ("loading", "kitchen")


@pytest.mark.parametrize("source", ["other client", "now", "after", "instead"])
def test_an_errand_from_a_table_does_not_count_as_delivered(source: str) -> None:
    runner = start_orders(("table_1",))
    runner.until("waiting", "table_1")
    runner.publish("goal_pose", pose(RECEPTION)) if source == "other client" else runner.publish(
        "errand", errand(source)
    )
    runner.run(60.0)
    assert runner.now.delivered == ()
    if source == "after":
        assert (runner.now.state, runner.reached[-1]) == ("waiting", "table_1")
        runner.publish("taken", Empty())
        runner.run(60.0)
    assert runner.reached[-1] == "reception"
    if source == "instead":
        assert runner.now.state == "idle"
        assert any("ended before it was served" in reason for reason in runner.now.skipped_reasons)


def test_emergency_stop_keeps_the_round_without_auto_resume() -> None:
    runner = start_orders(("table_1", "table_2"))
    runner.until("driving", "table_2")
    before = runner.now
    runner.press_stop(True)
    runner.publish("order", Order(("table_1",), "while stopped"))
    runner.run(60.0)
    runner.press_stop(False)
    runner.run(60.0)
    assert runner.reached == ["kitchen", "table_1"] and runner.now.hold_reason == "choice"
    kept = (runner.now.place, runner.now.queue, runner.now.delivered)
    assert kept == (before.place, before.queue, before.delivered) and len(runner.now.pending_orders) == 1
    runner.publish("round_choice", String("go_on"))
    runner.until("idle", "")
    assert runner.reached[2:] == ["table_2", "kitchen", "table_1", "home"]


def test_impossible_choices_are_rejected_with_a_message() -> None:
    runner = start_orders(("table_1",))
    runner.press_stop(True)
    runner.publish("round_choice", String("go_on"))
    runner.publish("errand", errand("now"))
    assert [notice.data for notice in runner.messages("delivery/notice")] == [
        "The emergency stop is active. Release STOP first."
    ] * 2


def test_a_rejection_by_emergency_stop_is_cleared_on_release() -> None:
    runner = DeliveryRunner()
    runner.press_stop(True)
    runner.publish("goal_pose", pose(RECEPTION))
    assert runner.messages("navigation_status")[-1].reason == REFUSED
    runner.press_stop(False)
    assert runner.messages("navigation_status")[-1].reason == ""
