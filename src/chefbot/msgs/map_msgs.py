"""map_msgs: changed parts of maps, as map servers and costmaps of ROS publish them and RViz shows them."""

from __future__ import annotations

from typing import Any

import numpy as np

from chefbot.msgs.idl.constraints import per_field
from chefbot.msgs.idl.message import Int8Array, Int32, Message, Uint32
from chefbot.msgs.nav_msgs import MAX_CELLS, cell_values
from chefbot.msgs.std_msgs import Header

_NO_CELLS = np.empty(0, np.int8)


def patch_cells(patch: Any) -> str:
    """Require that the patch's size fits its data, and that each cell is -1 or 0 to 100."""
    if len(patch.data) != patch.width * patch.height:
        return f"data has {len(patch.data)} cells, but the patch has {patch.width} x {patch.height}"
    return cell_values(patch.data)


class OccupancyGridUpdate(Message, frozen=True, eq=False):
    """A rectangle of an occupancy grid that has changed: column `x`, row `y`, its size, and its cells row by row."""

    MAX_LENGTHS = per_field(data=MAX_CELLS)
    RULES = (patch_cells,)

    header: Header = Header()
    x: Int32 = 0
    y: Int32 = 0
    width: Uint32 = 0
    height: Uint32 = 0
    data: Int8Array = _NO_CELLS
