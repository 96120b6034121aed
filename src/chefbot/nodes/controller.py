"""The local costmap, the controller on it, and the motions of recovery."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.behavior.behavior import Behavior, Progress
from chefbot.behavior.motions import Spin, Straight
from chefbot.control.controller import Controller, Status
from chefbot.control.dwa import Dwa
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalParams, ProgressChecker
from chefbot.costmap.conversions import LASER, costmap_message, mark_laser, mark_obstacles, plane_of
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LIVE, CostmapParams
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus, ObstacleScan
from chefbot.msgs.diagnostic_msgs import DiagnosticArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav2_msgs import (
    BackUp,
    BackUp_Feedback,
    BackUp_Goal,
    BackUp_Result,
    DriveOnHeading,
    DriveOnHeading_Feedback,
    DriveOnHeading_Goal,
    DriveOnHeading_Result,
    FollowPath,
    FollowPath_Feedback,
    FollowPath_Goal,
    FollowPath_Result,
    Spin_Feedback,
    Spin_Goal,
    Spin_Result,
)
from chefbot.msgs.nav2_msgs import Spin as SpinAction
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Bool, Float64, Header, String
from chefbot.nodes.motion_errors import BACK_UP, DRIVE, SPIN, Errors, motion_error
from chefbot.nodes.obstacle_sensors import ObstacleSensors
from chefbot.nodes.standing import LOST, Standing, WaitedTooLong
from chefbot.planning.local_replanning import length_left, near_planner, repaired
from chefbot.robot.motion_limits import Limits, max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.runtime.actions import serves
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.runtime.plugins import plugin
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

RATE = 10.0
NO_TRANSFORM, STUCK, NO_VALID_CONTROL, INVALID_PATH, PATIENCE_EXCEEDED = 102, 105, 106, 103, 104
"""As in nav2_msgs/action/FollowPath."""
ALLOWED = 30.0
"""Seconds for a motion whose giver says nothing of time."""
BLOCKED_PATIENCE = 3.0
"""Seconds that every way on may be blocked before it counts: people pass."""


AlongX = BackUp_Goal | DriveOnHeading_Goal
Ended = tuple[Duration, int, str]
"""How long it took, 0 or an error's code, and the sentence."""
LOCAL_COSTMAP = CostmapParams(track_unknown=False)
"""A camera sees little at once: what it has not seen is no obstacle here; the planner knows the map."""


class ControllerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The window of costs, and which controller with which settings."""

    costmap: CostmapParams = LOCAL_COSTMAP
    plugin: str = ""
    """`pkg.module:Class` of another controller; it is made with `settings`."""
    settings: DwaParams = DwaParams(period=1.0 / RATE)
    goal: GoalParams = GoalParams()
    speed: Annotated[
        float,
        Meta(
            ge=0.1,
            le=1.0,
            description="share of the robot's top speed that the built-in controller drives at",
        ),
    ] = 1.0


class ControllerNode(Node):
    """Serves paths and three motions, in the frame `odom`: what was seen stays where it was seen.

    It commands a twist only while every obstacle sensor of the robot file sends good data, and follows a path only
    while localization, where there is one, is sure. Else it stands, says why on `standing` (empty while it does not
    stand), and goes on by itself.
    """

    live_params = (
        *(f"costmap.{name}" for name in LIVE),
        *("settings.sim_time", "settings.*_samples", "settings.*_weight", "settings.slowing"),
        *("settings.rotate_from", "goal.*", "speed"),
    )
    params: ControllerNodeParams
    scan: In[LaserScan]
    obstacles: In[ObstacleScan]
    cmd_vel: In[Twist]
    clear_costmaps: In[Float64]
    emergency_stop: In[Bool]
    localization_status: In[LocalizationStatus]
    follow_path = serves(FollowPath)
    spin = serves(SpinAction)
    backup = serves(BackUp)
    drive_on_heading = serves(DriveOnHeading)
    cmd_vel_nav: Out[Twist]
    costmap: Out[OccupancyGrid] = topic("local_costmap/costmap", latched=True)
    standing: Out[String] = topic("controller/standing", latched=True)
    remark: Out[String] = topic("controller/remark")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Nothing to do."""
        self._costs = LayeredCostmap(self.params.costmap, self.robot.footprint_radius, rolling=True)
        self._controller = self._make_controller()
        self._progress = ProgressChecker()
        self._goal = SE2(0.0, 0.0, 0.0)
        self._planner = near_planner()
        self._path = self._given = np.zeros((0, 3))
        self._following: Future[FollowPath_Result] | None = None
        self._feedback: Callable[[FollowPath_Feedback], None] = lambda _: None
        self._blocked = 0.0
        self._motion: Behavior | None = None
        self._moved: Future[Progress] | None = None
        self._report: Callable[[], None] = lambda: None
        self._sensors = ObstacleSensors(self.robot)
        self._standing = Standing(self.standing, self.remark)

    def reconfigure(self, params: ControllerNodeParams) -> None:
        """From the next command on, on the path in hand."""
        self.params = params
        self._costs.retune(params.costmap)
        self._controller = self._make_controller()
        if len(self._given):
            self._controller.set_path(self._given, same_goal=False)

    def _make_controller(self) -> Controller:
        made: Controller = plugin(self.params.plugin, self._make_dwa, self.params.settings)
        return made

    def _make_dwa(self, settings: DwaParams) -> Dwa:
        limits = Limits.of(self.robot)
        return Dwa(limits._replace(speed=limits.speed * self.params.speed), settings, self.params.goal)

    # -- what is around

    def on_scan(self, scan: LaserScan) -> None:
        """The laser's layer."""
        self._sensors.see_scan(scan, self.now_ns, self._pose())
        stamp, frame = scan.header.stamp.ns, scan.header.frame_id
        self.tf.when("odom", frame, stamp, lambda pose: self._mark_laser(pose, scan))

    def _mark_laser(self, pose: SE2, scan: LaserScan) -> None:
        mark_laser(self._costs, pose, scan)
        self._sensors.place_scan(scan.header.stamp.ns)

    def on_obstacles(self, seen: ObstacleScan) -> None:
        """The camera's layer."""
        self._sensors.see_obstacles(seen, self.now_ns, self._pose())
        stamp, frame = seen.header.stamp.ns, seen.header.frame_id
        self.tf.when("odom", frame, stamp, lambda pose: self._mark_obstacles(pose, seen))

    def _mark_obstacles(self, pose: SE2, seen: ObstacleScan) -> None:
        mark_obstacles(self._costs, pose, seen, plane_of(self.robot))
        self._sensors.place_obstacles(seen.header.stamp.ns)

    def _pose(self) -> SE2 | None:
        """Of the robot by odometry, None before there is any."""
        try:
            return self.tf.lookup("odom", "base_link")
        except TransformError:
            return None

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Forget what the laser saw, it sees it again at once.

        What the camera saw stays until it looks through it: it is blind to what is near and beside it.
        """
        try:
            self._costs.clear_around(self.tf.lookup("odom", "base_link"), radius.data, LASER)
        except TransformError:
            return  # no odometry yet: nothing has been seen

    # -- orders

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Whoever gave an order must give it again after the release."""
        if pressed.data:
            for served in (self.follow_path, self.spin, self.backup, self.drive_on_heading):
                served.preempt()

    async def on_follow_path(
        self, goal: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Until the end of the path is reached, or there is no way on."""
        if is_pressed(self.emergency_stop.last):
            return FollowPath_Result(error_code=NO_VALID_CONTROL, error_msg=REFUSED)
        path = np.array([one.pose.se2 for one in goal.path.poses]).reshape(-1, 3)
        if len(path) == 0:
            return FollowPath_Result(error_code=INVALID_PATH, error_msg="The path has no poses.")
        try:
            odom_T_map = self.tf.lookup("odom", goal.path.header.frame_id)
        except TransformError as error:
            return FollowPath_Result(error_code=NO_TRANSFORM, error_msg=f"The path cannot be placed: {error}")
        self._take_path(path, odom_T_map)
        self._feedback = feedback
        self._following = Future()
        try:
            return await self._following
        except Cancelled:
            if not self.follow_path.replacing:
                self._halt()
            raise

    def _take_path(self, path: NDArray[np.float64], odom_T_map: SE2) -> None:
        goal = SE2.of(path[-1])
        same = self._following is not None and not self._following.done and goal == self._goal
        self._goal = goal
        if not same:
            self._progress.reset()
            self._blocked = 0.0
            self._standing.go_on()
        self._path = np.column_stack([odom_T_map.apply(path[:, :2]), path[:, 2] + odom_T_map.yaw])
        self._give(self._path, same_goal=same)

    def _give(self, path: NDArray[np.float64], *, same_goal: bool) -> None:
        self._given = path
        self._controller.set_path(path, same_goal=same_goal)

    async def on_spin(self, goal: Spin_Goal, feedback: Callable[[Spin_Feedback], None]) -> Spin_Result:
        """Turn on the spot."""
        turn, acceleration = max_turn(self.robot), max_turn_acceleration(self.robot)
        motion = Spin(float(goal.target_yaw), turn, acceleration, goal.time_allowance.seconds or ALLOWED)
        return Spin_Result(*await self._do(motion, SPIN, lambda: feedback(Spin_Feedback(motion.turned))))

    async def on_backup(
        self, goal: BackUp_Goal, feedback: Callable[[BackUp_Feedback], None]
    ) -> BackUp_Result:
        """Go back by target.x metres, whatever its sign (nav2_behaviors back_up.cpp)."""
        told = lambda metres: feedback(BackUp_Feedback(metres))  # noqa: E731
        return BackUp_Result(*await self._straight(-abs(goal.target.x), goal, BACK_UP, told))

    async def on_drive_on_heading(
        self, goal: DriveOnHeading_Goal, feedback: Callable[[DriveOnHeading_Feedback], None]
    ) -> DriveOnHeading_Result:
        """Go straight by target.x metres, negative is backwards; speed must have its sign."""
        if goal.target.x * goal.speed < 0.0:
            return DriveOnHeading_Result(Duration(), DRIVE.invalid, "Distance and speed have other signs.")
        told = lambda metres: feedback(DriveOnHeading_Feedback(metres))  # noqa: E731
        return DriveOnHeading_Result(*await self._straight(goal.target.x, goal, DRIVE, told))

    async def _straight(
        self, metres: float, goal: AlongX, errors: Errors, told: Callable[[float], None]
    ) -> Ended:
        if goal.target.y or goal.target.z:
            return Duration(), errors.invalid, "I drive straight only: target.y and z must be 0."
        speed = min(abs(float(goal.speed)) or max_speed(self.robot), max_speed(self.robot))
        allowed = goal.time_allowance.seconds or ALLOWED
        motion = Straight(metres, speed, max_acceleration(self.robot), allowed)
        return await self._do(motion, errors, lambda: told(abs(motion.driven)))

    async def _do(self, motion: Behavior, errors: Errors, report: Callable[[], None]) -> Ended:
        if is_pressed(self.emergency_stop.last):
            return Duration(), errors.unknown, REFUSED
        began, self._report = self.now_ns, report
        try:
            code, sentence = motion_error(await self._move(motion), errors)
        except WaitedTooLong as error:
            code, sentence = errors.unknown, str(error)
        return Duration.of((self.now_ns - began) / 1e9), code, sentence

    async def _move(self, motion: Behavior) -> Progress:
        self.follow_path.preempt()
        if self._moved is not None:
            self._moved.fail(Cancelled())  # another one's motion, which ends before this begins
        self._motion, self._moved = motion, Future()
        try:
            return await self._moved
        finally:
            self._motion = self._moved = None
            self._halt()

    # -- the control cycle

    @every(hz=RATE)
    def control(self) -> None:
        """One command, if there is something to do."""
        if self._motion is None and self._following is None:
            return
        pose = self._pose()
        if pose is None:
            return  # no odometry yet: the base stands
        self._costs.move_to(pose.x, pose.y)
        costs = self._costs.update()
        why = self._why_stand(pose)
        if why:
            self._stand(why)
        elif self._motion is not None and self._moved is not None:
            self._step_motion(self._motion, self._moved, pose, costs)
        elif self._following is not None:
            self._step_path(self._following, pose, costs)

    def _why_stand(self, pose: SE2) -> str:
        """A sentence, empty while it may move; a motion looks by its sensors alone, so it needs no localization."""
        status = self.localization_status.last
        lost = self._motion is None and status is not None and not status.localized
        return self._sensors.fault(self.now_ns, pose) or (LOST if lost else "")

    def _stand(self, why: str) -> None:
        """Wait for what is missing; to wait is not to be stuck, but it has an end."""
        self.cmd_vel_nav.publish(Twist())
        self._progress.reset()
        sentence = self._standing.wait(why, 1.0 / RATE)
        if sentence and self._moved is not None:
            self._moved.fail(WaitedTooLong(sentence))
        elif sentence and self._following is not None:
            result = FollowPath_Result(error_code=PATIENCE_EXCEEDED, error_msg=sentence)
            self._end(self._following, result)

    def _command(self, v: float, w: float, pose: SE2, costs: Costmap) -> str:
        """A twist, but not forward to where a blind camera does not look: then a sentence."""
        why = self._sensors.blind_ahead(pose, costs) if v > 0.0 else ""
        self.cmd_vel_nav.publish(Twist.of(0.0 if why else v, w))
        self._standing.go_on()
        return why

    def _step_motion(self, motion: Behavior, moved: Future[Progress], pose: SE2, costs: Costmap) -> None:
        step = motion.update(pose, costs, 1.0 / RATE)
        blind = self._command(step.v, step.w, pose, costs)
        self._report()
        if blind or step.progress is not Progress.RUNNING:
            moved.set(Progress.BLOCKED if blind else step.progress)

    def _step_path(self, following: Future[FollowPath_Result], pose: SE2, costs: Costmap) -> None:
        path = repaired(self._path, pose, costs, self._planner)
        if path is not self._given:
            self._give(path, same_goal=True)
        v, w, status = self._controller.command(pose, self._twist(), costs)
        blind = self._command(v, w, pose, costs)
        self._blocked = self._blocked + 1.0 / RATE if blind or status is Status.BLOCKED else 0.0
        moving = self._progress.moving(pose, 1.0 / RATE)
        if status is Status.REACHED:
            self._end(following, FollowPath_Result())
        elif self._blocked >= BLOCKED_PATIENCE:
            sentence = blind or "Something is in the way on every side."
            self._end(following, FollowPath_Result(error_code=NO_VALID_CONTROL, error_msg=sentence))
        elif not moving:
            self._end(
                following, FollowPath_Result(error_code=STUCK, error_msg="I try to move but do not get on.")
            )
        else:
            self._feedback(FollowPath_Feedback(length_left(path, pose), v))

    def _end(self, following: Future[FollowPath_Result], result: FollowPath_Result) -> None:
        self._halt()
        following.set(result)

    def _halt(self) -> None:
        """Stand still and want nothing."""
        self._following = None
        self.cmd_vel_nav.publish(Twist())
        self._standing.go_on()

    def _twist(self) -> tuple[float, float]:
        """Where the base's ramp is; what odometry measures lags behind it."""
        twist = self.cmd_vel.last or Twist()
        return twist.linear.x, twist.angular.z

    @every(hz=1)
    def publish_health(self) -> None:
        """Which sensor is at fault, also while nothing is to be done."""
        status = self._sensors.health(self.now_ns, self._pose(), self._costs.update())
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    @every(hz=1)
    def publish_costmap(self) -> None:
        """For looking, while something is done."""
        if self._motion is not None or self._following is not None:
            self.costmap.publish(costmap_message(Header.of(self.now_ns, "odom"), self._costs.update()))
