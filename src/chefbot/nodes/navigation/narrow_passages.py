"""Narrow passages: the robot creeps through where its body just fits, if there is no other path."""

from __future__ import annotations

from functools import partial

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.causes.reports import SLOW, make_report
from chefbot.control.controller_params import CONTROL_PERIOD
from chefbot.control.narrow_passage import NarrowPassage
from chefbot.control.path_follower import PathFollower, PathStep
from chefbot.control.people_cost import NearbyPeople
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.maths.costs import INSCRIBED, Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.idl.message import Message
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.nodes.local_map_walls import REACH, LocalMapWallsNode
from chefbot.nodes.navigation.costmap_layers import make_costmap
from chefbot.people.trails import BODY_RADIUS
from chefbot.planning.local_replanning import collides_within, local_planner, replan_locally
from chefbot.robot.spec import Robot
from chefbot.safety.collision_monitor import CollisionMonitor
from chefbot.safety.monitor_polygons import CREEP_SPEED
from chefbot.safety.params import CollisionMonitorParams

RESOLUTION, SIZE, INFLATION_RADIUS = 0.0125, 2.6, 0.4
"""Cells of the costmap in narrow passages, m, about the noise of a lidar; its side, and its inflation radius."""
MARGIN = CollisionMonitorParams().side_margin
"""Distance from the body that must be free, m: nearer to something the collision monitor stops the robot."""
PEOPLE_CLEARANCE = 0.1
"""Distance from the robot's edge to a person's body at which it does not pass, m."""
CREEPS = "The passage is barely wider than the robot: it creeps."


def fits_narrow_passages(robot: Robot) -> bool:
    """Return whether a robot may creep through narrow passages: a lidar sees both sides of it."""
    return robot.sensors.lidar is not None


def distance_from_people(robot: Robot) -> float:
    """Return the distance from a robot's centre to the middle of people at which it creeps past nobody, m."""
    return robot.circumscribed_radius + BODY_RADIUS + PEOPLE_CLEARANCE


def narrow_map_costs(
    costs: LayeredCostmap, map_only: Costmap, people: NDArray[np.float64], robot: Robot
) -> Costmap:
    """Return the costs of the map with narrow passages open, but none beside people (n, 2), m.

    Marks count where the map alone (`map_only`) has room: in a narrow passage a single wrong one closes the path, and
    the controller sees what is there.
    """
    with_room = map_only.cells < INSCRIBED
    return costs.narrow_costs(-0.5 * costs.resolution, people, distance_from_people(robot), with_room)


class NarrowPassagesNode(LocalMapWallsNode, CauseReportsNode):
    """Base class of a node that drives through narrow passages on a finer costmap of what is around."""

    def start(self) -> None:
        """Start on the usual costs."""
        super().start()
        replan = partial(replan_locally, planner=local_planner())
        self._passage = NarrowPassage(replan, collides_within, CONTROL_PERIOD)
        self._fine: tuple[LayeredCostmap, CollisionMonitor] | None = None
        """The finer costmap, and the memory of points that the collision monitor would stop for."""

    def _mark(self, message: Message, pose: SE2) -> None:
        super()._mark(message, pose)
        if self._fine is None:
            return
        costs, memory = self._fine
        costs.process(message, pose)
        if isinstance(message, LaserScan):
            memory.process_scan(message, pose)
        elif isinstance(message, ObstacleScan):
            memory.process_obstacles(message, pose)

    def _passage_costs(
        self, follower: PathFollower, pose: SE2, usual: Costmap, people: NearbyPeople
    ) -> Costmap:
        """Return the costs to follow a path on: with narrow passages open where that is the only path."""
        if not fits_narrow_passages(self.robot):
            return usual
        narrow = partial(self._narrow_costs, pose, people)
        paths = follower.given_path, follower.path
        costs = self._passage.select(*paths, pose, usual, narrow, stands=follower.is_blocked)
        if not self._passage.is_near:
            self._fine = None
        elif self._fine is None:
            params = msgspec.structs.replace(
                self.params.costmap, resolution=RESOLUTION, size=SIZE, inflation_radius=INFLATION_RADIUS
            )
            costmap = make_costmap(params, self.robot, rolling=True)
            self._follow(costmap, pose)
            self._fine = costmap, CollisionMonitor(self.robot, CollisionMonitorParams(), 0.0)
        return costs

    def _narrow_costs(self, pose: SE2, people: NearbyPeople) -> Costmap:
        assert self._fine is not None, "it has been filled since the path was blocked"
        costs, memory = self._fine
        self._follow(costs, pose)
        points = memory.points(pose, self.now_ns, REACH)
        costs.set_static_points(pose.apply(np.concatenate([points, self._unseen_walls(points)])))
        return costs.narrow_costs(MARGIN, people.states[:, :2], distance_from_people(self.robot))

    def _creep(self, step: PathStep) -> PathStep:
        """Return the step at the speed for a narrow passage, while the robot is in one; on the same arc."""
        self.report("passage", make_report(SLOW, "narrow passage", CREEPS) if self._passage.entered else None)
        if not self._passage.entered or step.v <= CREEP_SPEED:
            return step
        return step._replace(v=CREEP_SPEED, w=step.w * CREEP_SPEED / step.v)
