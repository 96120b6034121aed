"""The web UI's device shows how the navigation decides: local costmap, compared trajectories, cells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner
from tests.support.page_device import page_device
from tests.ui.test_map_edit_device import Shown

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.chefbot_msgs.navigation import CostmapCell, CostmapMark, TrajectoryCandidates
from chefbot.msgs.geometry_msgs import Point, Pose, TransformStamped, Twist
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.node import NoParams
from chefbot.ui.display.views import CellView
from chefbot.ui.inspect.navigation_device import NavigationDevice
from chefbot.ui.layers import LAYERS

MAP_T_ODOM = SE2(5.0, 3.0, math.pi / 2)


class Lens(NavigationDevice):
    """The base class alone, with a server that only keeps its layers."""

    params: NoParams

    def start(self) -> None:
        super().start()
        self._server = Shown()  # type: ignore[assignment]


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[NodeRunner]:
    with page_device(f"{__name__}:Lens", tmp_path, monkeypatch) as runner:
        yield runner


def shown(nodes: NodeRunner, topic: str, message: Any, *, localized: bool = True) -> dict[str, Any]:
    """The layers after a message, while the map frame is known or not."""
    if localized:
        transform = TransformStamped.of(0, "map", "odom", MAP_T_ODOM)
        nodes.loop.publish("tf", TFMessage((transform,)), "test")
    nodes.run(0.1)
    nodes.loop.publish(topic, message, "test")
    nodes.run(0.1)
    layers: dict[str, Any] = nodes.system.nodes["page"]._server.layers  # type: ignore[attr-defined]
    return layers


def local(origin: float) -> OccupancyGrid:
    return OccupancyGrid.of(Header.of(0, "odom"), Grid(np.full((4, 6), 100, np.int8), 0.5, origin, 0.0))


def test_the_local_costmap_is_placed_in_the_map(nodes: NodeRunner) -> None:
    layers = shown(nodes, "local_costmap/costmap", local(1.0))
    image = LAYERS["local_costmap"].validate(layers["local_costmap"])
    assert (image.x, image.y, image.yaw) == pytest.approx((5.0, 4.0, math.pi / 2), abs=1e-3)
    assert image.cells.shape == (4, 6) and (image.cells == 254).all() and image.resolution == 0.5


def test_nothing_is_placed_before_the_localization(nodes: NodeRunner) -> None:
    layers = shown(nodes, "local_costmap/costmap", local(0.0), localized=False)
    assert "local_costmap" not in layers


def test_trajectories_are_shown_from_best_to_inadmissible(nodes: NodeRunner) -> None:
    message = TrajectoryCandidates(
        Header.of(0, "odom"),
        Pose.of(SE2(1.0, 0.0, 0.0)),
        Twist.of(0.2, 0.0),
        np.array([0.2, 0.2, 0.2]),
        np.array([0.0, 1.0, -1.0]),
        np.array([3.0, 5.0, math.inf]),
        1.5,
    )
    view = shown(nodes, "trajectory_candidates", message)["candidates"]
    assert view.badness == (0.0, 1.0, None) and len(view.trajectories) == 3
    straight, left, right = (np.array(points).reshape(-1, 2) for points in view.trajectories)
    assert straight[0] == pytest.approx([5.0, 4.0]) and straight[-1] == pytest.approx([5.0, 4.3], abs=0.02)
    assert left[-1, 0] < 5.0 < right[-1, 0], "the map is turned by 90 degrees"
    empty = shown(nodes, "trajectory_candidates", TrajectoryCandidates(Header.of(0, "odom")))["candidates"]
    assert empty.trajectories == ()


def test_a_cell_is_shown_with_the_age_of_its_marks(nodes: NodeRunner) -> None:
    marks = (CostmapMark("lidar", Time.of(7 * 10**9)), CostmapMark("map", Time.of(0)))
    message = CostmapCell(Header.of(9 * 10**9, "map"), Point(1.0, 2.0, 0.0), 0.05, True, 254, marks)
    cell = shown(nodes, "costmap_cell", message)["cell"]
    assert cell == CellView(x=1.0, y=2.0, size=0.05, cost=254, marks=(("lidar", 2.0), ("map", None)))
    outside = shown(nodes, "costmap_cell", CostmapCell(Header.of(0, "map"), Point(9.0, 9.0, 0.0), 0.05))
    assert outside["cell"].cost is None


def test_a_request_names_the_point_in_the_map(nodes: NodeRunner) -> None:
    clicked: list[Any] = []
    nodes.loop.add_observer(lambda one: clicked.append(one.message) if one.topic == "clicked_point" else None)
    nodes.system.nodes["page"]._inspect_cell(1.5, -2.0)  # type: ignore[attr-defined]
    nodes.run(0.1)
    (point,) = clicked
    assert point.header.frame_id == "map" and (point.point.x, point.point.y) == (1.5, -2.0)
