"""The base classes of nodes, each in the smallest node that has them."""

from __future__ import annotations

from collections import Counter
from typing import Any

import msgspec
import numpy as np
import pytest
from tests.support.nodes import NodeRunner, StationaryRobot, commanded_speeds, send_goal_and_run

from chefbot.behavior.motion_errors import BACK_UP, DRIVE
from chefbot.costmap.params import LOCAL_COSTMAP, CostmapParams
from chefbot.delivery.params import DeliveryParams
from chefbot.errors import UserError
from chefbot.exploration.params import ExplorerParams
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import BackUp_Goal, DriveOnHeading_Goal, Spin_Goal
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Float64
from chefbot.nodes.behavior_server import BehaviorServerNode
from chefbot.nodes.deliveries.round import DeliveryRoundNode
from chefbot.nodes.exploration.frontier_map import MAP_TIMEOUT, FrontierMapNode
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.nodes.navigation.recovery_behaviors import COSTMAP_REFRESH_TIME, RecoveryBehaviorsNode
from chefbot.planning.params import PlannerParams
from chefbot.runtime.node import NoParams, Out
from chefbot.safety.params import SensorName


class CostmapOnlyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of a node with a local costmap alone."""

    costmap: CostmapParams = LOCAL_COSTMAP
    optional_sensors: tuple[SensorName, ...] = ()


class CostmapOnly(LocalCostmapNode):
    """A node that never drives."""

    params: CostmapOnlyParams


class FrontierParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that a node with frontiers must have."""

    explorer: ExplorerParams = ExplorerParams()
    costmap: CostmapParams = CostmapParams()
    planner: PlannerParams = PlannerParams()


class MapWaiter(FrontierMapNode):
    """Notes the times at which its waiting for a map ended."""

    params: FrontierParams

    def start(self) -> None:
        super().start()
        self.ends: list[float] = []
        self.spawn(self._wait_for_maps())

    async def _wait_for_maps(self) -> None:
        while True:
            await self._await_new_map()
            self.ends.append(self.now_ns / 1e9)


class Patient(RecoveryBehaviorsNode):
    """Clears the costmaps when a test lets it, and notes the time."""

    params: NoParams
    done: Out[Float64]

    def clear(self, radius: float) -> None:
        self.spawn(self._timed(radius))

    async def _timed(self, radius: float) -> None:
        start_ns = self.now_ns
        await self._clear_costmaps(radius)
        self.done.publish(Float64((self.now_ns - start_ns) / 1e9))


def test_a_node_that_stands_reports_sensors_but_no_costmap() -> None:
    runner = NodeRunner({"costs": f"{__name__}:CostmapOnly"}, {})
    runner.run(2.5)
    topics = Counter(one.topic for one in runner.published)
    assert topics["diagnostics"] == 2 and topics["local_costmap/costmap"] == 0
    assert CostmapOnly.live_params and all(name.startswith("costmap.") for name in CostmapOnly.live_params)
    runner.loop.publish(
        "clear_costmaps", Float64(1.0), "test"
    )  # before the first odometry: nothing is marked
    runner.run(0.1)


def test_a_wait_for_a_map_ends_with_the_map_or_the_timeout() -> None:
    runner = NodeRunner({"waiter": f"{__name__}:MapWaiter"}, {})
    node: Any = runner.system.nodes["waiter"]
    runner.run(10.0)
    assert node.ends == [], "before the first map it waits without an end"
    empty = OccupancyGrid(data=np.zeros(0, np.int8))
    runner.loop.publish("map", empty, "test")
    runner.run(1.0)
    runner.loop.publish("map", empty, "test")
    runner.run(MAP_TIMEOUT + 0.5)
    assert node.ends == pytest.approx([1.0, 1.0 + MAP_TIMEOUT], abs=1e-6)


def test_clearing_calls_all_costmaps_and_waits_for_sensors() -> None:
    runner = NodeRunner({"patient": f"{__name__}:Patient"}, {})
    node: Any = runner.system.nodes["patient"]
    node.clear(0.7)
    runner.run(5.0)
    assert [one.data for one in runner.messages("clear_costmaps")] == [0.7]
    assert [one.data for one in runner.messages("done")] == pytest.approx([COSTMAP_REFRESH_TIME])


def test_localization_is_lost_and_found_by_its_status() -> None:
    runner = NodeRunner({"patient": f"{__name__}:Patient"}, {})
    node: Any = runner.system.nodes["patient"]
    assert not node._localization.is_lost, "there may be no localization, as while mapping"
    for localized in (False, True):
        runner.loop.publish("localization_status", LocalizationStatus(localized=localized), "test")
        runner.run(0.1)
        assert node._localization.is_lost is not localized


@pytest.mark.parametrize(
    ("name", "goal", "code"),
    [
        ("backup", BackUp_Goal(Point(0.3, 0.0, 0.1), 0.1, Duration.of(5.0)), BACK_UP.invalid),
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3), -0.1, Duration.of(5.0)), DRIVE.invalid),
        ("drive_on_heading", DriveOnHeading_Goal(Point(0.3, 0.1), 0.1, Duration.of(5.0)), DRIVE.invalid),
    ],
)
def test_a_goal_that_is_not_a_motion_is_refused(name: str, goal: Any, code: int) -> None:
    robot = StationaryRobot()
    send_goal_and_run(robot, name, goal, 1.0)
    (outcome,) = robot.results(name)
    assert outcome.result.error_code == code and outcome.result.error_msg
    assert not any(commanded_speeds(robot))


class Round(DeliveryRoundNode):
    """A round whose events come from the test."""

    params: DeliveryParams


def test_tables_are_names_of_places_of_the_map() -> None:
    runner = NodeRunner({"round": f"{__name__}:Round"}, {})
    node: Any = runner.system.nodes["round"]
    with pytest.raises(UserError, match="no place"):
        node._resolve(("1",))  # the places are still to come
    runner.run(0.1)
    assert node._resolve(("2", "table_1", "home")) == ("table_2", "table_1", "home")
    with pytest.raises(UserError, match="table_7"):
        node._resolve(("1", "table_7"))


def test_a_behavior_server_starts_without_a_motion() -> None:
    robot = StationaryRobot()
    (server,) = (node for node in robot.system.nodes.values() if isinstance(node, BehaviorServerNode))
    robot.run(1.0)
    assert not any(commanded_speeds(robot)) and robot.results("spin") == []
    send_goal_and_run(robot, "spin", Spin_Goal(0.5, Duration.of(30.0)), 0.5)
    robot.request_stop(True)
    robot.run(0.5)
    assert server._motion is None
