"""Interface of the layers of a costmap, after nav2_costmap_2d::Layer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.costmap.params import CostmapParams
from chefbot.costmap.update_window import CellWindow
from chefbot.maths.se2 import SE2
from chefbot.msgs.idl.message import Message
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from chefbot.costmap.layered_costmap import LayeredCostmap


class LayerSettings(NamedTuple):
    """What the constructor of a layer receives: the parameters of its costmap, and the robot, None without one.

    drop_range: distance up to which the robot's depth camera shows every drop-off, m.
    """

    params: CostmapParams
    robot: Robot | None = None
    drop_range: float = 0.0


class CellMark(NamedTuple):
    """What marked a cell: the name of an obstacle layer, of the map or of a zone, and when it did so last, s.

    The time is 0 for what does not change, such as the map.
    """

    source: str
    time: float


class CostmapLayer(ABC):
    """A layer of a `LayeredCostmap`; its constructor receives `LayerSettings`.

    A custom one is named as `pkg.module:Class` in the parameter `layers`, at its place in the order of the layers.
    """

    def process(self, costs: LayeredCostmap, message: Message, frame: SE2) -> None:  # noqa: B027 (optional)
        """Take a message of the costmap node, whose frame is at `frame` in the costmap; ignore unknown types.

        What a sensor sees is marked with `costs.mark_and_clear`; for anything else that changes cells,
        `costs.note_change` names where.
        """

    def reach(self, costs: LayeredCostmap) -> int:  # noqa: ARG002 (interface)
        """Return how far a change of the layers below spreads in this one, cells."""
        return 0

    @abstractmethod
    def update_costs(self, costs: LayeredCostmap, cells: NDArray[np.uint8], window: CellWindow) -> None:
        """Write the costs of this layer over those of the layers below into a window of `cells`.

        cells: (h, w) of the whole costmap or, for a layer with a reach, of the window and that far around it.
        """

    def marks(
        self,
        costs: LayeredCostmap,  # noqa: ARG002 (interface)
        row: int,  # noqa: ARG002
        column: int,  # noqa: ARG002
    ) -> Sequence[CellMark]:
        """Return all that makes a cell lethal in this layer."""
        return ()
