"""Drives that fail: somebody stands in the only way, or the navigator dies on a long way."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import ROOM, Life

from chefbot.delivery.drive_retry import BLOCKED_PATH_TIMEOUT, NAVIGATOR_TIMEOUT, NO_NAVIGATOR, NO_VALID_PATH
from chefbot.msgs.chefbot_msgs import Errand, Order
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal, NavigateToPose_Result
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

KINDS = {
    "delivery": "chefbot.nodes.delivery:DeliveryNode",
    "people": "tests.support.nodes:People",
    "driver": "tests.nodes.test_blocked_path:Driver",
}


class Driver(Node):
    """A navigator that takes 2 s to everywhere; it finds the way to `place` blocked for `seconds` from the start."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    place, seconds = "", 0.0

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        await self.sleep(2.0)
        blocked = self.now_ns < self.seconds * 1e9 and goal.pose.pose.position.x == ROOM.get(self.place)
        return (
            NavigateToPose_Result(NO_VALID_PATH, "no way leads there") if blocked else NavigateToPose_Result()
        )


@pytest.mark.parametrize(
    ("place", "seconds", "state", "delivered", "missed"),
    [
        ("kitchen", 60.0, "idle", ("table_1", "table_2"), 0),
        ("home", 60.0, "idle", ("table_1", "table_2"), 0),
        ("table_1", 60.0, "failed", ("table_2",), 1),
        ("home", 10_000.0, "failed", ("table_1", "table_2"), 1),
    ],
)
def test_a_person_in_the_way_is_waited_for_if_there_is_no_detour(
    monkeypatch: pytest.MonkeyPatch,
    place: str,
    seconds: float,
    state: str,
    delivered: tuple[str, ...],
    missed: int,
) -> None:
    monkeypatch.setattr(Driver, "place", place)
    monkeypatch.setattr(Driver, "seconds", seconds)
    life = Life(KINDS, {})
    life.loop.publish("order", Order(("table_1", "table_2"), "one"), "somebody", from_device=True)
    life.run(BLOCKED_PATH_TIMEOUT + 60.0)
    status = life.heard("delivery_status")[-1]
    assert (status.state, status.delivered, len(status.skipped_reasons)) == (state, delivered, missed)


class MortalDriver(Node):
    """A navigator that dies 100 s after the start, on its way, and is away for `seconds`."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    seconds = 0.0

    async def on_navigate_to_pose(self, _: NavigateToPose_Goal, __: Any) -> NavigateToPose_Result:
        if self.now_ns < 100e9:
            await self.sleep(100.0)
        if self.now_ns < (100.0 + self.seconds) * 1e9:
            return NavigateToPose_Result(NO_NAVIGATOR, "nobody answered")
        await self.sleep(2.0)
        return NavigateToPose_Result()


@pytest.mark.parametrize(("away", "missed"), [(NAVIGATOR_TIMEOUT / 2, 0), (NAVIGATOR_TIMEOUT * 2, 1)])
def test_a_navigator_restart_on_a_long_path_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, away: float, missed: int
) -> None:
    monkeypatch.setattr(MortalDriver, "seconds", away)
    life = Life({**KINDS, "driver": "tests.nodes.test_blocked_path:MortalDriver"}, {})
    life.loop.publish("errand", Errand("table_1"), "somebody", from_device=True)
    life.run(100.0 + 3 * NAVIGATOR_TIMEOUT)
    status = life.heard("delivery_status")[-1]
    assert (status.state == "failed") == bool(missed), status
