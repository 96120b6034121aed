"""The waypoint follower: drives to waypoints in order, by action or as a patrol over places of the map."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from chefbot.behavior.waypoints import (
    ENDLESS_LOOPS,
    NO_VALID_WAYPOINTS,
    UNKNOWN,
    WaypointFollowerParams,
    WaypointRun,
)
from chefbot.errors import UserError
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.chefbot_msgs import PatrolOrder, Places
from chefbot.msgs.geometry_msgs import PoseStamped
from chefbot.msgs.nav_msgs import Goals
from chefbot.msgs.std_msgs import Empty
from chefbot.nodes.navigation.mission_node import MissionNode
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.coroutines import Cancelled
from chefbot.runtime.node import In
from chefbot.safety.emergency_stop import REFUSED
from chefbot.storage.places import find_place


class WaypointFollowerNode(MissionNode):
    """Serves follow_waypoints by navigate_to_pose; also accepts a `patrol` over places from the web UI.

    A goal of another client of the navigator ends the run.
    """

    live_params = ("*",)
    params: WaypointFollowerParams
    places: In[Places]
    patrol: In[PatrolOrder]
    cancel: In[Empty]
    follow_waypoints = action_server(nav2.FollowWaypoints)
    navigate_to_pose = action_client(nav2.NavigateToPose)
    patrol_client = action_client(nav2.FollowWaypoints, "follow_waypoints")
    passage_client = action_client(nav2.NavigateThroughPoses, "navigate_through_poses")

    def on_patrol(self, order: PatrolOrder) -> None:
        """Drive to the places, or through them, by the node's own or the other action."""
        self.spawn(self._patrol(order))

    def on_cancel(self, _: Empty) -> None:
        """End the run of any client."""
        self.follow_waypoints.preempt()

    async def _patrol(self, order: PatrolOrder) -> None:
        try:
            poses = self._poses_of(order.places)
        except UserError as error:
            self._publish_outcome(f"No patrol: {error}.")
            return
        if order.without_stops:
            goals = Goals(
                poses[0].header, poses * min(max(order.rounds, 1), nav2.MAX_WAYPOINTS // len(poses))
            )
            await self.passage_client.call(nav2.NavigateThroughPoses_Goal(goals))
        else:
            loops = order.rounds - 1 if order.rounds else ENDLESS_LOOPS
            await self.patrol_client.call(nav2.FollowWaypoints_Goal(loops, 0, poses))

    def _poses_of(self, names: Sequence[str]) -> tuple[PoseStamped, ...]:
        """Return the poses of places; UserError if one is missing."""
        known = self.places.last.places if self.places.last else ()
        places, labels = (
            {place.name: place.pose for place in known},
            {place.name: place.label for place in known},
        )
        if not names:
            raise UserError("it has no places")
        return tuple(places[find_place(name, places, labels)] for name in names)

    async def on_follow_waypoints(
        self, goal: nav2.FollowWaypoints_Goal, feedback: Callable[[nav2.FollowWaypoints_Feedback], None]
    ) -> nav2.FollowWaypoints_Result:
        """Drive to each waypoint; one that is missed ends the run or is left out, by `stop_on_failure`."""
        run = WaypointRun(goal.poses, goal.goal_index, goal.number_of_loops)
        if run.failure_reason:
            return self._end(nav2.FollowWaypoints_Result((), NO_VALID_WAYPOINTS, run.failure_reason))
        try:
            return self._end(await self._drive(run, len(goal.poses), feedback))
        except Cancelled:
            self._publish_outcome("The patrol has ended.")
            raise

    async def _drive(
        self, run: WaypointRun, count: int, feedback: Callable[[nav2.FollowWaypoints_Feedback], None]
    ) -> nav2.FollowWaypoints_Result:
        going_on = True
        while going_on:
            feedback(nav2.FollowWaypoints_Feedback(run.index))
            self._publish_phase(self._leg_sentence(run, count))
            result = await self.navigate_to_pose.call(nav2.NavigateToPose_Goal(run.pose))
            if result.error_msg == REFUSED:
                return nav2.FollowWaypoints_Result((), UNKNOWN, REFUSED)
            if result.error_code:
                going_on = run.missed(result.error_code, result.error_msg)
                if self.params.stop_on_failure:
                    return run.result(stopped=True)
            else:
                await self.sleep(self.params.waypoint_pause_duration)
                going_on = run.reached()
        return run.result(stopped=False)

    def _leg_sentence(self, run: WaypointRun, count: int) -> str:
        """Return where the robot drives to, as a sentence."""
        name = self._name_of(run.pose) or "waypoint"
        rounds = "" if run.number_of_loops == ENDLESS_LOOPS else f" of {run.number_of_loops + 1}"
        turn = f", round {run.loop + 1}{rounds}" if run.number_of_loops else ""
        return f"Driving to {name} ({run.index + 1} of {count}{turn})."

    def _name_of(self, pose: PoseStamped) -> str:
        places = self.places.last.places if self.places.last else ()
        return next((one.name.replace("_", " ") for one in places if one.pose.pose.se2 == pose.pose.se2), "")

    def _end(self, result: nav2.FollowWaypoints_Result) -> nav2.FollowWaypoints_Result:
        missed = (
            f"{len(result.missed_waypoints)} of the waypoints were missed." if result.missed_waypoints else ""
        )
        self._publish_outcome(result.error_msg or missed or "All waypoints were reached.")
        return result
