"""The drives of an exploration; the first one to a goal is given up early if the robot does not get on."""

from __future__ import annotations

import numpy as np

from chefbot.exploration.blockages import INSCRIBED
from chefbot.exploration.explorer import FULL_TURN, HELD_UP_WEIGHT, ExplorationGoal
from chefbot.maths.grid import FREE
from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.nav2_msgs import (
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.exploration.reports import ExplorationReportsNode
from chefbot.nodes.people.places import PeoplePlacesNode
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Future, wait_any

CHECK_PERIOD = 2.0
"""Period at which the frontier is checked on the growing map while driving, s."""
FIRST_RECOVERIES, LATER_RECOVERIES = 2, 4
"""Number of recoveries of the first drive to a goal, as others may be reached sooner, and of a later one."""
NEAR_DISTANCE = 0.5
"""Distance to a goal up to which a sensor that sees all around sees as much as from the goal, m."""
PERSON_DISTANCE = 1.5
"""Distance of a person from the robot or its goal up to which a drive may have failed because of this person, m."""


class ExplorationDrivesNode(ExplorationReportsNode, PeoplePlacesNode):
    """Base class of a node that explores: it drives to goals and notes those that cannot be reached."""

    fixed_frame = "map"
    navigate_to_pose = action_client(NavigateToPose)

    def start(self) -> None:
        """Start without having driven anywhere."""
        super().start()
        self._recoveries = 0
        self._held_up = False

    def on_navigate_to_pose(self, feedback: NavigateToPose_Feedback) -> None:
        """Note how many recoveries the drive has needed."""
        self._recoveries = feedback.number_of_recoveries

    def _go(self, pose: SE2) -> Future[NavigateToPose_Result]:
        self._recoveries = 0
        stamped = PoseStamped(Header.of(self.now_ns, "map"), Pose.of(pose))
        return self.navigate_to_pose.call(NavigateToPose_Goal(stamped))

    async def _reach(self, goal: ExplorationGoal) -> bool:
        """Drive to a goal until it is reached, cannot be reached, or its frontier is mapped; return whether it was
        reached."""
        driving, self._held_up = self._go(goal.pose), False
        try:
            while not driving.done and self._frontier_remains(goal) and not self._is_hopeless(goal):
                await wait_any(driving, self.sleep(CHECK_PERIOD))
                if self._recoveries and self._is_near(goal) and not self._base_fault:
                    return True
        finally:
            driving.discard()
        failed = driving.result().error_code != 0 if driving.done else self._is_hopeless(goal)
        if failed and self._base_fault:
            await self._await_end_of_fault()
        elif failed and self._is_beside_person(goal):
            self._held_up = True
            self._explorer.mark_failed(goal, HELD_UP_WEIGHT)
        elif failed:
            self._note_failed(goal)
        return driving.done and not failed

    def _is_hopeless(self, goal: ExplorationGoal) -> bool:
        """Return whether an obstacle has been seen at the goal, or the drive to it has needed too many recoveries."""
        costmap, pose = self.planner_costmap.last, goal.pose
        if costmap is not None and costmap.grid.value(pose.x, pose.y, outside=FREE) >= INSCRIBED:
            return True
        return self._recoveries > (LATER_RECOVERIES if self._explorer.has_failed(goal) else FIRST_RECOVERIES)

    def _is_near(self, goal: ExplorationGoal) -> bool:
        """Return whether the robot sees from here what it would see from the goal, as before a mirror."""
        distance = self.tf.lookup("map", "base_link").distance(goal.pose)
        return self._explorer.field_of_view >= FULL_TURN and distance <= NEAR_DISTANCE

    def _is_beside_person(self, goal: ExplorationGoal) -> bool:
        """Return whether somebody is near the robot or where it goes."""
        places = self._people()[1]
        ends = self.tf.lookup("map", "base_link"), goal.pose
        distances = [np.hypot(places[:, 0] - end.x, places[:, 1] - end.y) for end in ends]
        return bool((np.array(distances) <= PERSON_DISTANCE).any())
