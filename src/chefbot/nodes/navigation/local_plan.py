"""The local plan of the controller for display: the trajectory that it chose, and those that it compared."""

from __future__ import annotations

from chefbot.control.controller import ComparedTwists
from chefbot.control.path_follower import PathFollower
from chefbot.msgs.chefbot_navigation import TrajectoryCandidates
from chefbot.msgs.geometry_msgs import Pose, Twist
from chefbot.msgs.nav_msgs import Path
from chefbot.msgs.std_msgs import Header
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import Node, Out


class LocalPlanNode(Node):
    """Base class of a node that publishes what its controller plans in the frame `odom`."""

    local_plan: Out[Path]
    trajectory_candidates: Out[TrajectoryCandidates]

    def _publish_plan(self, follower: PathFollower, duration: float) -> None:
        """Publish the chosen trajectory (s) and the candidates of the latest cycle; nothing before the first."""
        header = Header.of(self.now_ns, "odom")
        trajectory = follower.trajectory(Limits.of(self.robot), duration)
        if trajectory is not None:
            self.local_plan.publish(Path.of(header, trajectory))
            self.trajectory_candidates.publish(candidates_message(header, follower.candidates()))


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
