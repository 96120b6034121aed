"""Simultaneous localization and mapping."""

from chefbot.slam.gmapping import Gmapping
from chefbot.slam.graph import GraphSlam, GraphSlamParams
from chefbot.slam.offline import SlamResult, run_log, trajectory_tum
from chefbot.slam.params import GmappingParams

__all__ = [
    "Gmapping",
    "GmappingParams",
    "GraphSlam",
    "GraphSlamParams",
    "SlamResult",
    "run_log",
    "trajectory_tum",
]
