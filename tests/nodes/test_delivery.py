"""The waiter with the real navigator and base: what a STOP, a "go to" or a goal of a stranger does to its round."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import ROOM, Life

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
    "legs": "tests.nodes.test_delivery:Legs",
}


class Legs(Node):
    """Planner and controller that need 2 s to everywhere; `reached` notes where the robot came."""

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


class Waiter(Life):
    """In a room with a kitchen and two tables."""

    def __init__(self, **delivery: float) -> None:
        super().__init__(KINDS, {}, {"delivery": delivery})
        self.run(0.1)

    def say(self, topic: str, message: Any) -> None:
        self.loop.publish(topic, message, "somebody", from_device=True)
        self.run(0.1)

    def until(self, state: str, place: str) -> None:
        """As people do it: load and take what is there."""
        for _ in range(100):
            if (self.now.state, self.now.place) == (state, place):
                return
            press = {"loading": "loaded", "waiting": "taken"}.get(self.now.state)
            if press:
                self.say(press, Empty())
            self.run(0.1)
        raise AssertionError(f"never {state} {place}: {self.now}")

    @property
    def now(self) -> DeliveryStatus:
        status: DeliveryStatus = self.heard("delivery_status")[-1]
        return status

    @property
    def reached(self) -> list[str]:
        legs: Any = self.system.nodes["legs"]
        names = {x: name for name, x in ROOM.items()} | {RECEPTION: "reception"}
        return [names[x] for x in legs.reached]

    def press_stop(self, pressed: bool) -> None:
        self.say("stop_request", Bool(pressed))


def pose(x: float) -> PoseStamped:
    return PoseStamped(Header.of(0, "map"), Pose.of(SE2(x, 0.0, 0.0)))


def go(when: str) -> Errand:
    return Errand("reception", pose(RECEPTION), when)


def ordered(*orders: tuple[str, ...], **delivery: float) -> Waiter:
    waiter = Waiter(**delivery)
    for number, tables in enumerate(orders):
        waiter.say("order", Order(tables, str(number)))
    return waiter


def test_robot_waits_for_confirmation_in_kitchen_and_at_table() -> None:
    waiter = ordered(("table_1",))
    waiter.run(600.0)
    assert (waiter.now.state, waiter.reached) == ("loading", ["kitchen"])
    waiter.say("loaded", Empty())
    waiter.run(600.0)
    assert (waiter.now.state, waiter.now.delivered, waiter.reached) == ("waiting", (), ["kitchen", "table_1"])
    waiter.say("taken", Empty())
    waiter.run(60.0)
    assert (waiter.now.state, waiter.now.delivered) == ("idle", ("table_1",))


def test_configured_timers_replace_confirmations() -> None:
    waiter = ordered(("table_1",), loading_time=3.0, taking_time=10.0)
    waiter.run(60.0)
    assert (waiter.now.state, waiter.now.delivered) == ("idle", ("table_1",))


def test_timers_pause_during_emergency_stop() -> None:
    waiter = ordered(("table_1",), loading_time=3.0, taking_time=10.0)
    waiter.run(5.0)
    assert waiter.now.state == "waiting"
    waiter.press_stop(True)
    waiter.run(60.0)
    assert (waiter.now.state, waiter.now.delivered) == ("waiting", ())


@pytest.mark.parametrize("way", ["stranger", "now"])
def test_a_go_to_on_the_way_to_a_table_keeps_the_orders(way: str) -> None:
    waiter = ordered(("table_1", "table_2"), ("table_2",))
    waiter.until("driving", "table_1")
    waiter.say("goal_pose", pose(RECEPTION)) if way == "stranger" else waiter.say("errand", go("now"))
    waiter.run(5.0)
    assert waiter.reached[-1] == "reception" and waiter.now.hold_reason == "choice"
    assert (waiter.now.place, waiter.now.queue, len(waiter.now.pending_orders)) == (
        "table_1",
        ("table_2",),
        1,
    )
    waiter.say("round_choice", String("go_on"))
    waiter.until("idle", "")
    assert waiter.reached[2:] == ["table_1", "table_2", "home", "kitchen", "table_2", "home"]
    assert not waiter.now.skipped_reasons


@pytest.mark.parametrize("way", ["stranger", "now"])
def test_a_go_to_while_loaded_is_driven_to_its_end(way: str) -> None:
    waiter = ordered(("table_1",))
    waiter.until("loading", "kitchen")
    waiter.say("goal_pose", pose(RECEPTION)) if way == "stranger" else waiter.say("errand", go("now"))
    waiter.say("loaded", Empty())
    waiter.run(60.0)
    assert waiter.reached == ["kitchen", "reception"] and waiter.now.hold_reason == "choice"
    waiter.say("round_choice", String("go_on"))
    waiter.run(5.0)
    assert (waiter.now.state, waiter.reached[-1]) == ("loading", "kitchen")


@pytest.mark.parametrize("way", ["stranger", "now", "after", "instead"])
def test_a_go_to_from_a_table_does_not_count_as_delivered(way: str) -> None:
    waiter = ordered(("table_1",))
    waiter.until("waiting", "table_1")
    waiter.say("goal_pose", pose(RECEPTION)) if way == "stranger" else waiter.say("errand", go(way))
    waiter.run(60.0)
    assert waiter.now.delivered == ()
    if way == "after":
        assert (waiter.now.state, waiter.reached[-1]) == ("waiting", "table_1")
        waiter.say("taken", Empty())
        waiter.run(60.0)
    assert waiter.reached[-1] == "reception"
    if way == "instead":
        assert waiter.now.state == "idle"
        assert any("ended before it was served" in one for one in waiter.now.skipped_reasons)


def test_emergency_stop_keeps_the_round_without_auto_resume() -> None:
    waiter = ordered(("table_1", "table_2"))
    waiter.until("driving", "table_2")
    before = waiter.now
    waiter.press_stop(True)
    waiter.say("order", Order(("table_1",), "while stopped"))
    waiter.run(60.0)
    waiter.press_stop(False)
    waiter.run(60.0)
    assert waiter.reached == ["kitchen", "table_1"] and waiter.now.hold_reason == "choice"
    kept = (waiter.now.place, waiter.now.queue, waiter.now.delivered)
    assert kept == (before.place, before.queue, before.delivered) and len(waiter.now.pending_orders) == 1
    waiter.say("round_choice", String("go_on"))
    waiter.until("idle", "")
    assert waiter.reached[2:] == ["table_2", "home", "kitchen", "table_1", "home"]


def test_impossible_choices_are_refused_with_a_message() -> None:
    waiter = ordered(("table_1",))
    waiter.press_stop(True)
    waiter.say("round_choice", String("go_on"))
    waiter.say("errand", go("now"))
    assert [one.data for one in waiter.heard("delivery/remark")] == [
        "STOP is pressed. Press Resume first."
    ] * 2


def test_a_refusal_due_to_emergency_stop_clears_on_release() -> None:
    waiter = Waiter()
    waiter.press_stop(True)
    waiter.say("goal_pose", pose(RECEPTION))
    assert waiter.heard("navigation_status")[-1].reason == REFUSED
    waiter.press_stop(False)
    assert waiter.heard("navigation_status")[-1].reason == ""
