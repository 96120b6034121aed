"""The services of a navigation tree, implemented with the navigator's action clients."""

from __future__ import annotations

from typing import cast

from chefbot.behavior.recovery import UNRECOVERABLE_ERRORS
from chefbot.behavior.relocalization import LOST
from chefbot.behavior_tree.leaves import Pending
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Point, PoseStamped
from chefbot.msgs.nav_msgs import Path
from chefbot.nodes.navigation.obstacle_facing import ObstacleFacingNode
from chefbot.nodes.navigation.path_waiting import HELD_UP_ERRORS, PathWaitingNode
from chefbot.nodes.navigation.retreating import RetreatingNode
from chefbot.runtime.actions import action_client
from chefbot.runtime.transform_buffer import TransformError

PATIENCE_EXCEEDED = 104
"""Error code of nav2_msgs/action/FollowPath; here also: not localized in time."""
AT_POSE_DISTANCE = 0.25
"""Distance up to which the robot is at a pose, m; as the default tolerance of Nav2's goal checkers."""


class TreeServicesNode(PathWaitingNode, ObstacleFacingNode, RetreatingNode):
    """Base class of a node whose behavior tree navigates. It keeps the last failure, and counts recoveries."""

    follow_path = action_client(nav2.FollowPath)

    def start(self) -> None:
        """Create the tree's services, and clear failures and recoveries."""
        super().start()
        self.services = NodeServices(self)
        self._restart_services()

    def _restart_services(self) -> None:
        """Forget the failures and recoveries of the goal before."""
        self._restart_waiting()
        self._failure: tuple[int, str] = (0, "")
        self._goal_notice = ""
        self._recoveries = 0

    def _begin_recovery(self) -> None:
        self._recoveries += 1
        self._publish_status("recovering", self._failure[1])


class NodeServices:
    """Implements the services of `navigation_nodes` with one node."""

    def __init__(self, node: TreeServicesNode) -> None:
        self._node = node

    def is_localized(self) -> bool:
        """Return whether localization is not lost."""
        return not self._node._localization.is_lost

    def is_recoverable(self, error_code: int) -> bool:
        """Return whether a recovery behavior may help against an error."""
        return error_code not in UNRECOVERABLE_ERRORS

    def note_failure(self, error_code: int, error_msg: str) -> None:
        """Keep why the goal was not reached this time."""
        self._node._failure = error_code, error_msg

    def relocalize(self) -> Pending:
        """Rotate in place until localization has converged."""
        self._node._publish_status("recovering", LOST)
        return self._node._pending(self._relocalize())

    async def _relocalize(self) -> nav2.FollowPath_Result:
        failure_reason = await self._node._relocalize()
        return nav2.FollowPath_Result(
            error_code=PATIENCE_EXCEEDED if failure_reason else 0, error_msg=failure_reason
        )

    def compute_path(self, goal: object, start: object) -> Pending:
        """Plan a path to a PoseStamped, from another one or from the robot's pose."""
        return self._node._pending(self._node._plan(cast(PoseStamped, goal), cast(PoseStamped | None, start)))

    def follow_path(self, path: object) -> Pending:
        """Follow a Path; the controller preempts the one before."""
        self._node._publish_status("driving", self._node._goal_notice)
        return self._node.follow_path.call(nav2.FollowPath_Goal(cast(Path, path)))

    def spin(self, angle: float, time_allowance: float) -> Pending:
        """Rotate in place by an angle, as a recovery behavior."""
        self._node._begin_recovery()
        return self._node._pending(self._node._spin_by(angle, time_allowance))

    def back_up(self, distance: float, speed: float, time_allowance: float) -> Pending:
        """Back up by a distance, as a recovery behavior."""
        self._node._begin_recovery()
        goal = nav2.BackUp_Goal(Point(-distance), speed, Duration.of(time_allowance))
        return self._node._pending(self._node._back_up(goal))

    def back_up_to_see(self) -> Pending:
        """Back up until the robot sees what its collision monitor remembers, as a recovery behavior."""
        return self._node._pending(self._node._back_up_to_see())

    def wait(self, seconds: float) -> Pending:
        """Stand still for a time, as a recovery behavior."""
        self._node._begin_recovery()
        return self._node.sleep(seconds)

    def clear_costmaps(self, radius: float) -> Pending:
        """Clear obstacles within a radius in all costmaps."""
        self._node._begin_recovery()
        return self._node._pending(self._node._clear_costmaps(radius))

    def find_blocked_path(self, goal: object, error_code: int, find_waiting_pose: bool) -> Pending | None:
        """Find what the robot should wait for."""
        if not self._node._may_be_blocked(error_code):
            return None
        finding = self._node._blocked_path(cast(PoseStamped, goal), error_code, find_waiting_pose)
        return self._node._pending(finding)

    def wait_for_path(self, goal: object, error_code: int) -> Pending:
        """Wait until the path is free or another one is quicker."""
        waiting = self._node._wait_for_path(cast(PoseStamped, goal), error_code in HELD_UP_ERRORS)
        return self._node._pending(waiting)

    def is_at(self, pose: object) -> bool:
        """Return whether the robot is at a PoseStamped in the frame map; a pose without a frame counts as reached."""
        if not cast(PoseStamped, pose).header.frame_id:
            return True
        try:
            robot = self._node.tf.lookup("map", "base_link")
        except TransformError:
            return False
        return robot.distance(cast(PoseStamped, pose).pose.se2) <= AT_POSE_DISTANCE

    def is_goal_occupied(self) -> bool:
        """Return whether the newest path ends beside its occupied goal, as the planner reported."""
        return bool(self._node._goal_notice)

    def face_obstacle(self, goal: object) -> Pending:
        """Rotate in place until the robot faces what occupies a PoseStamped; no recovery, the goal is near enough."""
        return self._node._pending(self._node._face_obstacle(cast(PoseStamped, goal)))
