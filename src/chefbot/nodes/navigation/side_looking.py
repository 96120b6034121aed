"""Looks to the sides before the robot drives on, on a robot whose camera sees only ahead."""

from __future__ import annotations

from chefbot.causes.reports import STOP, make_report
from chefbot.control.controller_params import CONTROL_PERIOD
from chefbot.control.path_follower import PathStep
from chefbot.control.people_cost import NearbyPeople
from chefbot.control.side_look import SideLook
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.chefbot_msgs.people import TrackedPeople
from chefbot.msgs.geometry_msgs import Twist
from chefbot.nodes.causes.reports import CauseReportsNode
from chefbot.nodes.local_costmap import LocalCostmapNode
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.runtime.node import In
from chefbot.safety.known_obstacles import MarkedCells
from chefbot.safety.obstacle_sensors import camera_view, max_blind_distance

LOOKS = "People are nearby: the robot looks to its sides before it drives on."
HIDDEN = "Something beside the robot is too near to be seen; the robot waits."
MAX_AHEAD_YAW = 0.1
"""Yaw of the camera's mount up to which it looks ahead, rad."""


def side_look_of(robot: Robot) -> SideLook | None:
    """Return what decides when a robot looks to its sides, None if it does not.

    It does not with a lidar, without a camera that looks ahead, or if it cannot rotate in place everywhere, as it is
    not a disc.
    """
    camera = robot.sensors.depth_camera
    if camera is None or robot.sensors.lidar is not None or robot.footprint.corners:
        return None
    if abs(camera.mount.yaw) > MAX_AHEAD_YAW:
        return None
    return SideLook(camera.field_of_view / 2.0, Limits.of(robot), CONTROL_PERIOD)


class SideLookingNode(LocalCostmapNode, CauseReportsNode):
    """Base class of a node that looks to the robot's sides before it drives forward along a path."""

    cmd_vel: In[Twist]

    def start(self) -> None:
        """Start without having looked anywhere."""
        super().start()
        self._side_look = side_look_of(self.robot)
        self._view: tuple[SE2, ObstacleScan] | None = None
        self._hidden = ""
        """Why the robot must not drive forward since it has looked to its sides; empty if it may."""

    def on_tracked_people(self, message: TrackedPeople) -> None:
        """Note that people are about, also while nothing drives the robot."""
        super().on_tracked_people(message)
        if self._side_look is not None and message.people:
            self._side_look.note_people(self.now_ns)

    def _mark_obstacles(self, pose: SE2, scan: ObstacleScan) -> None:
        super()._mark_obstacles(pose, scan)
        self._view = (pose, scan)

    def _stop_looking(self) -> None:
        """Forget a look that has begun: something else drives the robot."""
        self._hidden = ""
        if self._side_look is not None:
            self._side_look.reset()
            self.report("side", None)

    def _look_aside(self, step: PathStep, pose: SE2, costs: Costmap, people: NearbyPeople) -> PathStep:
        """Return the step with the rotation of a look to the sides in place of driving forward, if one is needed."""
        look = self._side_look
        if look is None or step.result is not None:
            return step
        self._note_view(look, costs)
        present = self.cmd_vel.last or Twist()
        command = look.step(pose, step.v, present.linear.x, people, self.now_ns)
        self._hidden = HIDDEN if command is not None and command.hidden else ""
        self.report(
            "side", make_report(STOP, "view to the sides", self._hidden or LOOKS) if command else None
        )
        return step if command is None else step._replace(v=0.0, w=command.w)

    def _note_view(self, look: SideLook, costs: Costmap) -> None:
        """Note which directions the newest obstacle scan shows; marked obstacles explain what it does not."""
        view, self._view = self._view, None
        if view is None:
            return
        sensor, scan = view
        camera = self.robot.sensors.depth_camera
        assert camera is not None, "only a robot with a camera looks to its sides"
        mount, measurable = camera.mount.planar, self._sensors.measurable
        robot, directions = sensor @ mount.inverse(), sensor.yaw + scan.angles
        marked = MarkedCells(costs, robot).explain(scan.angles, mount, max_blind_distance(camera))
        has_data = ~camera_view(scan).mute | marked
        look.seen.process(robot, directions[measurable], has_data[measurable], scan.header.stamp.ns)
