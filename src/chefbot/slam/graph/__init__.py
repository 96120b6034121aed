"""Graph SLAM: submaps, loop closures and a pose graph."""

from chefbot.slam.graph.closures import ClosureResidual
from chefbot.slam.graph.graph_slam import GraphSlam
from chefbot.slam.graph.params import GraphSlamParams

__all__ = ["ClosureResidual", "GraphSlam", "GraphSlamParams"]
