"""The controller server: local costmap, path following and the motions of recovery behaviors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.behavior.behavior import Behavior, BehaviorProgress
from chefbot.behavior.motions import DriveStraight, Spin
from chefbot.control.controller import Controller, ControllerStatus
from chefbot.control.dwa import DwaController
from chefbot.control.dwa_params import DwaParams
from chefbot.control.goal_checkers import GoalParams, ProgressChecker
from chefbot.costmap.conversions import LASER, costmap_message, mark_laser, mark_obstacles, plane_of
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LIVE_PARAMS, CostmapParams
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
from chefbot.nodes.motion_errors import BACK_UP, DRIVE, SPIN, BehaviorErrorCodes, motion_error
from chefbot.nodes.obstacle_sensors import ObstacleSensors
from chefbot.nodes.waiting_state import LOST, WaitingState, WaitTimeoutError
from chefbot.planning.local_replanning import local_planner, remaining_length, replan_locally
from chefbot.robot.motion_limits import Limits, max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.runtime.plugins import load_plugin
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.emergency_stop import REFUSED, is_pressed

RATE = 10.0
NO_TRANSFORM, STUCK, NO_VALID_CONTROL, INVALID_PATH, PATIENCE_EXCEEDED = 102, 105, 106, 103, 104
"""Error codes of nav2_msgs/action/FollowPath."""
DEFAULT_TIME_ALLOWANCE = 30.0
"""Time allowance of a motion whose goal has none, s."""
BLOCKED_TIMEOUT = 3.0
"""Time without an admissible command before the path counts as blocked, s: people pass by."""

StraightGoal = BackUp_Goal | DriveOnHeading_Goal
MotionResult = tuple[Duration, int, str]
"""Elapsed time, error code (0 if none) and error message."""
LOCAL_COSTMAP = CostmapParams(track_unknown=False)
"""Unknown space is free here, because a camera sees little at once; the planner has the map."""


class ControllerNodeParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the local costmap and of the controller plugin."""

    costmap: CostmapParams = LOCAL_COSTMAP
    plugin: str = ""
    """`pkg.module:Class` of a custom controller; its constructor receives `settings`."""
    settings: DwaParams = DwaParams(period=1.0 / RATE)
    goal: GoalParams = GoalParams()
    speed: Annotated[
        float,
        Meta(
            ge=0.1,
            le=1.0,
            description="fraction of the maximum speed that the built-in controller uses",
        ),
    ] = 1.0


class ControllerNode(Node):
    """Serves follow_path and three motions in the frame `odom`, in which marked obstacles do not jump.

    It commands a twist only while every obstacle sensor of the robot file sends valid data, and follows a path only
    while localization, if there is one, has converged. Otherwise it stands still, publishes the reason on `standing`
    (empty while it does not wait), and resumes by itself.
    """

    live_params = (
        *(f"costmap.{name}" for name in LIVE_PARAMS),
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
    follow_path = action_server(FollowPath)
    spin = action_server(SpinAction)
    backup = action_server(BackUp)
    drive_on_heading = action_server(DriveOnHeading)
    cmd_vel_nav: Out[Twist]
    costmap: Out[OccupancyGrid] = topic("local_costmap/costmap", latched=True)
    standing: Out[String] = topic("controller/standing", latched=True)
    remark: Out[String] = topic("controller/remark")
    diagnostics: Out[DiagnosticArray]

    def start(self) -> None:
        """Create the local costmap, the controller and the sensor monitors."""
        self._costs = LayeredCostmap(self.params.costmap, self.robot.footprint_radius, rolling=True)
        self._controller = self._make_controller()
        self._progress = ProgressChecker()
        self._goal = SE2(0.0, 0.0, 0.0)
        self._planner = local_planner()
        self._path = self._tracked_path = np.zeros((0, 3))
        self._following: Future[FollowPath_Result] | None = None
        self._feedback: Callable[[FollowPath_Feedback], None] = lambda _: None
        self._blocked_time = 0.0
        self._motion: Behavior | None = None
        self._motion_ended: Future[BehaviorProgress] | None = None
        self._send_feedback: Callable[[], None] = lambda: None
        self._sensors = ObstacleSensors(self.robot)
        self._standing = WaitingState(self.standing, self.remark)

    def reconfigure(self, params: ControllerNodeParams) -> None:
        """Apply new parameters from the next command on, for the current path as well."""
        self.params = params
        self._costs.reconfigure(params.costmap)
        self._controller = self._make_controller()
        if len(self._tracked_path):
            self._controller.set_path(self._tracked_path, same_goal=False)

    def _make_controller(self) -> Controller:
        controller: Controller = load_plugin(self.params.plugin, self._make_dwa, self.params.settings)
        return controller

    def _make_dwa(self, settings: DwaParams) -> DwaController:
        limits = Limits.of(self.robot)
        return DwaController(
            limits._replace(speed=limits.speed * self.params.speed), settings, self.params.goal
        )

    # -- local costmap

    def on_scan(self, scan: LaserScan) -> None:
        """Update the laser's obstacle layer with a scan."""
        self._sensors.process_scan(scan, self.now_ns, self._pose())
        stamp, frame = scan.header.stamp.ns, scan.header.frame_id
        self.tf.on_available("odom", frame, stamp, lambda pose: self._mark_laser(pose, scan))

    def _mark_laser(self, pose: SE2, scan: LaserScan) -> None:
        mark_laser(self._costs, pose, scan)
        self._sensors.note_scan_marked(scan.header.stamp.ns)

    def on_obstacles(self, scan: ObstacleScan) -> None:
        """Update the camera's obstacle layers with an obstacle scan."""
        self._sensors.process_obstacles(scan, self.now_ns, self._pose())
        stamp, frame = scan.header.stamp.ns, scan.header.frame_id
        self.tf.on_available("odom", frame, stamp, lambda pose: self._mark_obstacles(pose, scan))

    def _mark_obstacles(self, pose: SE2, scan: ObstacleScan) -> None:
        mark_obstacles(self._costs, pose, scan, plane_of(self.robot))
        self._sensors.note_obstacles_marked(scan.header.stamp.ns)

    def _pose(self) -> SE2 | None:
        try:
            return self.tf.lookup("odom", "base_link")
        except TransformError:
            return None

    def on_clear_costmaps(self, radius: Float64) -> None:
        """Clear the laser layer around the robot; the next scan marks again what is still there.

        The camera layers stay until a beam clears them: the camera does not see what is near or beside it.
        """
        try:
            self._costs.clear_around(self.tf.lookup("odom", "base_link"), radius.data, LASER)
        except TransformError:
            return  # no odometry yet: nothing has been marked

    # -- action servers

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Preempt all goals on an emergency stop; clients must send them again after the release."""
        if pressed.data:
            for server in (self.follow_path, self.spin, self.backup, self.drive_on_heading):
                server.preempt()

    async def on_follow_path(
        self, goal: FollowPath_Goal, feedback: Callable[[FollowPath_Feedback], None]
    ) -> FollowPath_Result:
        """Follow the path until its end is reached, or fail if the robot is blocked or stuck."""
        if is_pressed(self.emergency_stop.last):
            return FollowPath_Result(error_code=NO_VALID_CONTROL, error_msg=REFUSED)
        path = np.array([pose.pose.se2 for pose in goal.path.poses]).reshape(-1, 3)
        if len(path) == 0:
            return FollowPath_Result(error_code=INVALID_PATH, error_msg="The path has no poses.")
        try:
            odom_T_map = self.tf.lookup("odom", goal.path.header.frame_id)
        except TransformError as error:
            return FollowPath_Result(error_code=NO_TRANSFORM, error_msg=f"The path cannot be placed: {error}")
        self._accept_path(path, odom_T_map)
        self._feedback = feedback
        self._following = Future()
        try:
            return await self._following
        except Cancelled:
            if not self.follow_path.preempting:
                self._stop()
            raise

    def _accept_path(self, path: NDArray[np.float64], odom_T_map: SE2) -> None:
        goal = SE2.of(path[-1])
        same_goal = self._following is not None and not self._following.done and goal == self._goal
        self._goal = goal
        if not same_goal:
            self._progress.reset()
            self._blocked_time = 0.0
            self._standing.resume()
        self._path = np.column_stack([odom_T_map.apply(path[:, :2]), path[:, 2] + odom_T_map.yaw])
        self._set_tracked_path(self._path, same_goal=same_goal)

    def _set_tracked_path(self, path: NDArray[np.float64], *, same_goal: bool) -> None:
        self._tracked_path = path
        self._controller.set_path(path, same_goal=same_goal)

    async def on_spin(self, goal: Spin_Goal, feedback: Callable[[Spin_Feedback], None]) -> Spin_Result:
        """Rotate in place by target_yaw, rad."""
        turn_rate, acceleration = max_turn(self.robot), max_turn_acceleration(self.robot)
        motion = Spin(
            float(goal.target_yaw),
            turn_rate,
            acceleration,
            goal.time_allowance.seconds or DEFAULT_TIME_ALLOWANCE,
        )
        return Spin_Result(
            *await self._run_motion(motion, SPIN, lambda: feedback(Spin_Feedback(motion.turned)))
        )

    async def on_backup(
        self, goal: BackUp_Goal, feedback: Callable[[BackUp_Feedback], None]
    ) -> BackUp_Result:
        """Back up by target.x metres, whatever its sign (nav2_behaviors back_up.cpp)."""
        publish_driven = lambda distance: feedback(BackUp_Feedback(distance))  # noqa: E731
        return BackUp_Result(*await self._drive_straight(-abs(goal.target.x), goal, BACK_UP, publish_driven))

    async def on_drive_on_heading(
        self, goal: DriveOnHeading_Goal, feedback: Callable[[DriveOnHeading_Feedback], None]
    ) -> DriveOnHeading_Result:
        """Drive straight by target.x metres, negative is backwards; the speed must have the same sign."""
        if goal.target.x * goal.speed < 0.0:
            return DriveOnHeading_Result(
                Duration(), DRIVE.invalid, "Distance and speed must have the same sign."
            )
        publish_driven = lambda distance: feedback(DriveOnHeading_Feedback(distance))  # noqa: E731
        return DriveOnHeading_Result(*await self._drive_straight(goal.target.x, goal, DRIVE, publish_driven))

    async def _drive_straight(
        self,
        distance: float,
        goal: StraightGoal,
        errors: BehaviorErrorCodes,
        publish_driven: Callable[[float], None],
    ) -> MotionResult:
        if goal.target.y or goal.target.z:
            return (
                Duration(),
                errors.invalid,
                "Only straight motions are supported: target.y and target.z must be 0.",
            )
        speed = min(abs(float(goal.speed)) or max_speed(self.robot), max_speed(self.robot))
        time_allowance = goal.time_allowance.seconds or DEFAULT_TIME_ALLOWANCE
        motion = DriveStraight(distance, speed, max_acceleration(self.robot), time_allowance)
        return await self._run_motion(motion, errors, lambda: publish_driven(abs(motion.driven)))

    async def _run_motion(
        self, motion: Behavior, errors: BehaviorErrorCodes, report: Callable[[], None]
    ) -> MotionResult:
        if is_pressed(self.emergency_stop.last):
            return Duration(), errors.unknown, REFUSED
        start_ns, self._send_feedback = self.now_ns, report
        try:
            code, sentence = motion_error(await self._await_motion(motion), errors)
        except WaitTimeoutError as error:
            code, sentence = errors.unknown, str(error)
        return Duration.of((self.now_ns - start_ns) / 1e9), code, sentence

    async def _await_motion(self, motion: Behavior) -> BehaviorProgress:
        self.follow_path.preempt()
        if self._motion_ended is not None:
            self._motion_ended.set_exception(Cancelled())  # a previous motion ends before this one begins
        self._motion, self._motion_ended = motion, Future()
        try:
            return await self._motion_ended
        finally:
            self._motion = self._motion_ended = None
            self._stop()

    # -- control loop

    @every(hz=RATE)
    def control(self) -> None:
        """Publish one command while a path or a motion is active."""
        if self._motion is None and self._following is None:
            return
        pose = self._pose()
        if pose is None:
            return  # no odometry yet: the base stands still
        self._costs.move_to(pose.x, pose.y)
        costs = self._costs.update()
        reason = self._reason_to_wait(pose)
        if reason:
            self._wait_standing(reason)
        elif self._motion is not None and self._motion_ended is not None:
            self._step_motion(self._motion, self._motion_ended, pose, costs)
        elif self._following is not None:
            self._step_path(self._following, pose, costs)

    def _reason_to_wait(self, pose: SE2) -> str:
        status = self.localization_status.last
        lost = self._motion is None and status is not None and not status.localized
        return self._sensors.fault(self.now_ns, pose) or (LOST if lost else "")

    def _wait_standing(self, reason: str) -> None:
        self.cmd_vel_nav.publish(Twist())
        self._progress.reset()
        sentence = self._standing.wait(reason, 1.0 / RATE)
        if sentence and self._motion_ended is not None:
            self._motion_ended.set_exception(WaitTimeoutError(sentence))
        elif sentence and self._following is not None:
            result = FollowPath_Result(error_code=PATIENCE_EXCEEDED, error_msg=sentence)
            self._finish_path(self._following, result)

    def _command(self, v: float, w: float, pose: SE2, costs: Costmap) -> str:
        reason = self._sensors.blind_ahead(pose, costs) if v > 0.0 else ""
        self.cmd_vel_nav.publish(Twist.of(0.0 if reason else v, w))
        self._standing.resume()
        return reason

    def _step_motion(
        self, motion: Behavior, ended: Future[BehaviorProgress], pose: SE2, costs: Costmap
    ) -> None:
        step = motion.update(pose, costs, 1.0 / RATE)
        blind = self._command(step.v, step.w, pose, costs)
        self._send_feedback()
        if blind or step.progress is not BehaviorProgress.RUNNING:
            ended.set_result(BehaviorProgress.BLOCKED if blind else step.progress)

    def _step_path(self, following: Future[FollowPath_Result], pose: SE2, costs: Costmap) -> None:
        # replan locally around obstacles that are not on the map
        path = replan_locally(self._path, pose, costs, self._planner)
        if path is not self._tracked_path:
            self._set_tracked_path(path, same_goal=True)
        # one cycle of the controller, and the checks for progress
        v, w, status = self._controller.command(pose, self._commanded_twist(), costs)
        blind = self._command(v, w, pose, costs)
        self._blocked_time = (
            self._blocked_time + 1.0 / RATE if blind or status is ControllerStatus.BLOCKED else 0.0
        )
        moving = self._progress.is_progressing(pose, 1.0 / RATE)
        if status is ControllerStatus.REACHED:
            self._finish_path(following, FollowPath_Result())
        elif self._blocked_time >= BLOCKED_TIMEOUT:
            sentence = blind or "No collision-free command."
            self._finish_path(following, FollowPath_Result(error_code=NO_VALID_CONTROL, error_msg=sentence))
        elif not moving:
            self._finish_path(
                following, FollowPath_Result(error_code=STUCK, error_msg="No progress: the robot is stuck.")
            )
        else:
            self._feedback(FollowPath_Feedback(remaining_length(path, pose), v))

    def _finish_path(self, following: Future[FollowPath_Result], result: FollowPath_Result) -> None:
        self._stop()
        following.set_result(result)

    def _stop(self) -> None:
        self._following = None
        self.cmd_vel_nav.publish(Twist())
        self._standing.resume()

    def _commanded_twist(self) -> tuple[float, float]:
        twist = self.cmd_vel.last or Twist()
        return twist.linear.x, twist.angular.z

    @every(hz=1)
    def publish_health(self) -> None:
        """Publish the health of the obstacle sensors, also while no goal is active."""
        status = self._sensors.health(self.now_ns, self._pose(), self._costs.update())
        self.diagnostics.publish(DiagnosticArray(Header.of(self.now_ns, "base_link"), (status,)))

    @every(hz=1)
    def publish_costmap(self) -> None:
        """Publish the local costmap for display while a path or motion is active."""
        if self._motion is not None or self._following is not None:
            self.costmap.publish(costmap_message(Header.of(self.now_ns, "odom"), self._costs.update()))
