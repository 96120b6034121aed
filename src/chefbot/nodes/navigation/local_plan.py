"""The local plan of the controller for display: the trajectory that it chose, and those that it compared."""

from __future__ import annotations

from chefbot.control.controller import ComparedTwists
from chefbot.control.controller_params import LOCAL_PLAN_RATE
from chefbot.control.path_follower import PathFollower
from chefbot.msgs.chefbot_msgs.navigation import TrajectoryCandidates
from chefbot.msgs.geometry_msgs import Pose, Twist
from chefbot.msgs.nav2_msgs import FollowPath_Result
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.navigation.controller_params import ControllerNodeParams
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.coroutines import Future
from chefbot.runtime.node import Node, Out, every


class LocalPlanNode(Node):
    """Base class of a node that publishes what its controller plans in the frame `odom`."""

    params: ControllerNodeParams
    local_plan: Out[Path]
    trajectory_candidates: Out[TrajectoryCandidates]
    _follower: PathFollower
    _following: Future[FollowPath_Result] | None

    @every(hz=LOCAL_PLAN_RATE)
    def publish_local_plan(self) -> None:
        """Publish the chosen trajectory and the candidates of the latest cycle while a path is followed."""
        if self._following is None:
            return
        header = Header.of(self.now_ns, "odom")
        trajectory = self._follower.trajectory(Limits.of(self.robot), self.params.settings.sim_time)
        if trajectory is not None:
            self.local_plan.publish(Path.of(header, trajectory))
            self.trajectory_candidates.publish(candidates_message(header, self._follower.candidates()))


def candidates_message(header: Header, candidates: ComparedTwists | None) -> TrajectoryCandidates:
    """Return the message for display, empty if nothing was compared."""
    if candidates is None:
        return TrajectoryCandidates(header)
    return TrajectoryCandidates(
        header,
        Pose.of(candidates.pose),
        Twist.of(*candidates.present),
        candidates.twists[:, 0].copy(),
        candidates.twists[:, 1].copy(),
        candidates.scores,
        candidates.duration,
    )
