"""Tolerances of goals: those of the place at which a path ends."""

from __future__ import annotations

from chefbot.control.goal_checkers import GoalParams
from chefbot.control.path_follower import PathFollower
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Places
from chefbot.msgs.nav_msgs import Path
from chefbot.runtime.node import In, Node
from chefbot.runtime.transform_buffer import TransformError

SAME_POSE_TOLERANCE = 1e-3
"""Differences up to which two poses are one, m and rad."""


class GoalTolerancesNode(Node):
    """Base class of a node that follows paths and knows how exactly their ends have to be reached."""

    places: In[Places]
    _path_frame = "odom"

    def _tolerance_of(self, path: Path) -> GoalParams | None:
        """Return the tolerances that the place at the end of a path asks for; None if it asks for none."""
        self._path_frame, end = path.header.frame_id, SE2.of(path.array[-1])
        for place in self.places.last.places if self.places.last else ():
            pose = place.pose.pose.se2
            same = (
                pose.distance(end) <= SAME_POSE_TOLERANCE
                and abs(wrap(pose.yaw - end.yaw)) <= SAME_POSE_TOLERANCE
            )
            if same and (place.xy_tolerance or place.yaw_tolerance):
                usual = GoalParams()
                return GoalParams(
                    xy_tolerance=place.xy_tolerance or usual.xy_tolerance,
                    yaw_tolerance=place.yaw_tolerance or usual.yaw_tolerance,
                )
        return None

    def _place_goal(self, follower: PathFollower) -> None:
        """Give the follower the newest pose of the path's frame, which localization corrects meanwhile."""
        try:
            follower.frame = self.tf.lookup("odom", self._path_frame)
        except TransformError:
            return  # the follower keeps the last one
