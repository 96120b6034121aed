"""Parameters of the controller server."""

from __future__ import annotations

from chefbot.control.controller_params import ControllerParams
from chefbot.costmap.params import LOCAL_COSTMAP, CostmapParams


class ControllerNodeParams(ControllerParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the local costmap and of the controller plugin."""

    costmap: CostmapParams = LOCAL_COSTMAP
