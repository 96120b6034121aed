"""The base class of mappers publishes a map as a whole, and its changed rectangle as a patch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.grid import Grid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.scans.map_publisher import MapPublisherNode
from chefbot.runtime.node import NoParams


class BareMapper(MapPublisherNode):
    """The base class alone."""

    params: NoParams


def grid(width: int = 8, *occupied: tuple[int, int]) -> Grid:
    """Return a free map 5 cells high, with occupied cells (row, column)."""
    cells = np.zeros((5, width), np.int8)
    for cell in occupied:
        cells[cell] = 100
    return Grid(cells, 0.05, -1.0, -2.0)


def publish(*grids: Grid) -> NodeRunner:
    nodes = NodeRunner({"mapper": f"{__name__}:BareMapper"}, {})
    mapper: Any = nodes.system.nodes["mapper"]
    for one in grids:
        mapper.publish_grid(Header.of(nodes.loop.now_ns, "map"), one)
    nodes.run(0.1)
    return nodes


def test_the_first_map_has_no_patch() -> None:
    nodes = publish(grid(8, (2, 3)))
    (whole,) = nodes.messages("map")
    assert (whole.info.width, whole.info.height, whole.header.frame_id) == (8, 5, "map")
    assert nodes.messages("map_updates") == []


def test_a_patch_is_the_rectangle_of_the_changed_cells() -> None:
    nodes = publish(grid(8, (2, 3)), grid(8, (2, 3), (1, 2), (3, 6)))
    assert len(nodes.messages("map")) == 2
    (patch,) = nodes.messages("map_updates")
    assert (patch.x, patch.y, patch.width, patch.height) == (2, 1, 5, 3)
    expected = np.zeros((3, 5), np.int8)
    expected[1, 1] = expected[0, 0] = expected[2, 4] = 100
    assert np.asarray(patch.data).tolist() == expected.reshape(-1).tolist()


@pytest.mark.parametrize("second", [grid(8, (2, 3)), grid(9, (2, 3))])
def test_an_unchanged_or_grown_map_has_no_patch(second: Grid) -> None:
    nodes = publish(grid(8, (2, 3)), second)
    assert len(nodes.messages("map")) == 2
    assert nodes.messages("map_updates") == []
