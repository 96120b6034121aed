"""Parameters of the controller server."""

from __future__ import annotations

from chefbot.control.controller_params import ControllerParams
from chefbot.costmap.params import LOCAL_COSTMAP, CostmapParams
from chefbot.safety.params import SensorName


class ControllerNodeParams(ControllerParams, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the local costmap and of the controller plugin."""

    costmap: CostmapParams = LOCAL_COSTMAP
    optional_sensors: tuple[SensorName, ...] = ()
    """Sensors of the robot file that need not be connected: they count from their first message on."""
