"""Tests deliveries whose path is blocked by a person or whose navigator restarts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.planning.rooms import walled
from tests.support.nodes import ROOM, NodeRunner

from chefbot.delivery.drive_retry import BLOCKED_PATH_TIMEOUT, NAVIGATOR_TIMEOUT, NO_NAVIGATOR, NO_VALID_PATH
from chefbot.maths.grid import OCCUPIED, Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Errand, Order
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal, NavigateToPose_Result
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.actions import action_server
from chefbot.runtime.node import Node, NoParams

KINDS = {
    "delivery": "chefbot.nodes.delivery:DeliveryNode",
    "people": "tests.support.nodes:FakeStaff",
    "driver": "tests.nodes.test_blocked_path:BlockedNavigator",
}


class BlockedNavigator(Node):
    """Reaches each goal after 2 s, except `place`, whose path is blocked in the first `seconds`."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    place, seconds = "", 0.0

    async def on_navigate_to_pose(self, goal: NavigateToPose_Goal, _: Any) -> NavigateToPose_Result:
        await self.sleep(2.0)
        blocked = self.now_ns < self.seconds * 1e9 and goal.pose.pose.position.x == ROOM.get(self.place)
        return NavigateToPose_Result(NO_VALID_PATH, "no valid path") if blocked else NavigateToPose_Result()


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
    monkeypatch.setattr(BlockedNavigator, "place", place)
    monkeypatch.setattr(BlockedNavigator, "seconds", seconds)
    runner = NodeRunner(KINDS, {})
    runner.loop.publish("order", Order(("table_1", "table_2"), "one"), "client", from_device=True)
    runner.run(BLOCKED_PATH_TIMEOUT + 60.0)
    status = runner.messages("delivery_status")[-1]
    assert (status.state, status.delivered, len(status.skipped_reasons)) == (state, delivered, missed)


def test_a_kitchen_without_a_path_on_the_map_fails_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BlockedNavigator, "place", "kitchen")
    monkeypatch.setattr(BlockedNavigator, "seconds", 10_000.0)
    runner = NodeRunner(KINDS, {})
    cells = np.array(walled(12.0, 6.0).cells)
    cells[:, 130] = OCCUPIED  # a wall from side to side between home and kitchen
    hall = OccupancyGrid.of(Header.of(0, "map"), Grid(cells, 0.05, -6.0, -3.0))
    runner.loop.publish("map", hall, "map_server", latched=True)
    for parent, child in (("map", "odom"), ("odom", "base_link")):
        stamped = TransformStamped.of(0, parent, child, SE2(ROOM["home"], 0.0, 0.0))
        runner.loop.publish("tf", TFMessage((stamped,)), "localization", from_device=True)
    runner.loop.publish("order", Order(("table_1",), "one"), "client", from_device=True)
    runner.run(30.0)
    status = runner.messages("delivery_status")[-1]
    assert status.state == "failed" and "no valid path" in status.description, status.description


class RestartingNavigator(Node):
    """Fails 100 s after the start, during a drive, and is absent for `seconds`."""

    params: NoParams
    navigate_to_pose = action_server(NavigateToPose)
    seconds = 0.0

    async def on_navigate_to_pose(self, _: NavigateToPose_Goal, __: Any) -> NavigateToPose_Result:
        if self.now_ns < 100e9:
            await self.sleep(100.0)
        if self.now_ns < (100.0 + self.seconds) * 1e9:
            return NavigateToPose_Result(NO_NAVIGATOR, "no navigator")
        await self.sleep(2.0)
        return NavigateToPose_Result()


@pytest.mark.parametrize(("absence", "missed"), [(NAVIGATOR_TIMEOUT / 2, 0), (NAVIGATOR_TIMEOUT * 2, 1)])
def test_a_navigator_restart_on_a_long_path_is_waited_for(
    monkeypatch: pytest.MonkeyPatch, absence: float, missed: int
) -> None:
    monkeypatch.setattr(RestartingNavigator, "seconds", absence)
    runner = NodeRunner({**KINDS, "driver": "tests.nodes.test_blocked_path:RestartingNavigator"}, {})
    runner.loop.publish("errand", Errand("table_1"), "client", from_device=True)
    runner.run(100.0 + 3 * NAVIGATOR_TIMEOUT)
    status = runner.messages("delivery_status")[-1]
    assert (status.state == "failed") == bool(missed), status
