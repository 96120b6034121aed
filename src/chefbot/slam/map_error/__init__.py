"""The error of a map, estimated from its scans and poses alone, without the true floor plan."""

from chefbot.slam.map_error.estimate import REGION, MapErrorEstimate, MapRegion, estimate_map_error

__all__ = ["REGION", "MapErrorEstimate", "MapRegion", "estimate_map_error"]
