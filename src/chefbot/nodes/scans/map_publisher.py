"""Base class of mappers: publishes the map as a whole and what has changed in it as a patch."""

from __future__ import annotations

from chefbot.mapping.map_patch import changed_part
from chefbot.maths.grid import Grid
from chefbot.msgs.map_msgs import OccupancyGridUpdate
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.scans.scan_listener import ScanListenerNode
from chefbot.runtime.node import Out, topic


class MapPublisherNode(ScanListenerNode):
    """Publishes `map`, and on `map_updates` its changed rectangle, as RViz and Nav2 read them.

    A map that has grown or moved has no patch: its subscribers need the whole.
    """

    map: Out[OccupancyGrid] = topic(latched=True)
    map_updates: Out[OccupancyGridUpdate]

    def start(self) -> None:
        """Start without a map that was published."""
        super().start()
        self._published: Grid | None = None

    def publish_grid(self, header: Header, grid: Grid) -> None:
        """Publish a map with this header."""
        patch = changed_part(self._published, grid) if self._published is not None else None
        self._published = grid
        self.map.publish(OccupancyGrid.of(header, grid))
        if patch is not None and patch.cells.size:
            height, width = patch.cells.shape
            cells = patch.cells.reshape(-1)
            self.map_updates.publish(
                OccupancyGridUpdate(header, patch.column, patch.row, width, height, cells)
            )
