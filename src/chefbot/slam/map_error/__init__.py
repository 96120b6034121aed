"""The error of a map, estimated from its scans and poses alone, without the true floor plan."""

from chefbot.slam.map_error.error_grid import error_grid
from chefbot.slam.map_error.estimate import REGION, MapErrorEstimate, MapRegion, estimate_map_error
from chefbot.slam.map_error.verdict import centimetres, verdict

__all__ = [
    "REGION",
    "MapErrorEstimate",
    "MapRegion",
    "centimetres",
    "error_grid",
    "estimate_map_error",
    "verdict",
]
