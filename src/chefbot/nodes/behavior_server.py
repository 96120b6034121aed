"""The behavior server: the motions of recovery behaviors, checked on the local costmap."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from chefbot.behavior.behavior import Behavior, BehaviorProgress, guarded_step
from chefbot.behavior.motion_errors import BACK_UP, DRIVE, SPIN, BehaviorErrorCodes, motion_error
from chefbot.behavior.motion_goals import InvalidMotionError, back_up_motion, heading_motion, spin_motion
from chefbot.behavior.motions import DriveStraight, Spin
from chefbot.control.waiting_state import WaitingState, WaitTimeoutError
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.msgs import nav2_msgs as nav2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Bool, String
from chefbot.nodes.causes.local_causes import LocalCausesNode
from chefbot.runtime.actions import action_server
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Out, topic
from chefbot.safety.emergency_stop import REFUSED, is_pressed

M = TypeVar("M", Spin, DriveStraight)
MotionResult = tuple[Duration, int, str]
"""Elapsed time, error code (0 if none) and error message."""


class BehaviorServerNode(LocalCausesNode):
    """Base class of a node that serves spin, backup and drive_on_heading, one motion at a time.

    While it waits for a sensor it publishes the reason on `controller/wait_reason`, else an empty one.
    """

    emergency_stop: In[Bool]
    spin = action_server(nav2.Spin)
    backup = action_server(nav2.BackUp)
    drive_on_heading = action_server(nav2.DriveOnHeading)
    cmd_vel_nav: Out[Twist]
    wait_reason: Out[String] = topic("controller/wait_reason", latched=True)
    notice: Out[String] = topic("controller/notice")

    def start(self) -> None:
        """Start with no motion in progress."""
        super().start()
        self._motion: Behavior | None = None
        self._motion_ended: Future[BehaviorProgress] | None = None
        self._send_feedback: Callable[[], None] = lambda: None
        self._waiting = WaitingState()

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Preempt all goals on an emergency stop; clients must send them again after the release."""
        if pressed.data:
            self._preempt_path()
            for server in (self.spin, self.backup, self.drive_on_heading):
                server.preempt()

    async def on_spin(
        self, goal: nav2.Spin_Goal, feedback: Callable[[nav2.Spin_Feedback], None]
    ) -> nav2.Spin_Result:
        """Rotate in place by target_yaw, rad."""
        report = lambda motion: feedback(nav2.Spin_Feedback(motion.turned))  # noqa: E731
        return nav2.Spin_Result(*await self._run(lambda: spin_motion(goal, self.robot), SPIN, report))

    async def on_backup(
        self, goal: nav2.BackUp_Goal, feedback: Callable[[nav2.BackUp_Feedback], None]
    ) -> nav2.BackUp_Result:
        """Back up by target.x metres, whatever its sign."""
        report = lambda motion: feedback(nav2.BackUp_Feedback(abs(motion.driven)))  # noqa: E731
        return nav2.BackUp_Result(*await self._run(lambda: back_up_motion(goal, self.robot), BACK_UP, report))

    async def on_drive_on_heading(
        self, goal: nav2.DriveOnHeading_Goal, feedback: Callable[[nav2.DriveOnHeading_Feedback], None]
    ) -> nav2.DriveOnHeading_Result:
        """Drive straight by target.x metres, negative is backwards; the speed must have the same sign."""
        report = lambda motion: feedback(nav2.DriveOnHeading_Feedback(abs(motion.driven)))  # noqa: E731
        return nav2.DriveOnHeading_Result(
            *await self._run(lambda: heading_motion(goal, self.robot), DRIVE, report)
        )

    async def _run(
        self, make: Callable[[], M], errors: BehaviorErrorCodes, report: Callable[[M], None]
    ) -> MotionResult:
        """Run the motion that `make` returns, and return its result in the error codes of its action."""
        try:
            motion = make()
        except InvalidMotionError as error:
            return Duration(), errors.invalid, str(error)
        if is_pressed(self.emergency_stop.last):
            return Duration(), errors.unknown, REFUSED
        start_ns, self._send_feedback = self.now_ns, lambda: report(motion)
        try:
            code, sentence = motion_error(await self._await_motion(motion), errors)
        except WaitTimeoutError as error:
            code, sentence = errors.unknown, str(error)
        return Duration.of((self.now_ns - start_ns) / 1e9), code, sentence

    async def _await_motion(self, motion: Behavior) -> BehaviorProgress:
        self._preempt_path()
        if self._motion_ended is not None:
            self._motion_ended.set_exception(Cancelled())  # a previous motion ends before this one begins
        self._motion, self._motion_ended = motion, Future()
        try:
            return await self._motion_ended
        finally:
            self._motion = self._motion_ended = None
            self._stop()

    def _preempt_path(self) -> None:
        """End what else drives the robot, before a motion begins."""

    def _step_motion(self, pose: SE2, costs: Costmap, blind: str, dt: float) -> None:
        """Command the next `dt` seconds of the motion, and end it once it is done or has failed."""
        assert self._motion is not None and self._motion_ended is not None
        ended, step = self._motion_ended, guarded_step(self._motion, pose, costs, dt, blind)
        self._drive(step.v, step.w)
        self.report_motion(step.progress, pose, costs, blind)
        self._send_feedback()
        if step.progress is not BehaviorProgress.RUNNING:
            ended.set_result(step.progress)

    def _wait(self, reason: str, dt: float) -> str:
        """Stand still for another `dt` seconds; once the timeout has passed the motion fails.

        Returns the message of the timeout, before it an empty string.
        """
        self.cmd_vel_nav.publish(Twist())
        self.report_waiting(reason)
        sentence = self._waiting.wait(reason, dt)
        self._publish_waiting()
        if sentence and self._motion_ended is not None:
            self._motion_ended.set_exception(WaitTimeoutError(sentence))
        return sentence

    def _drive(self, v: float, w: float) -> None:
        """Command a twist (m/s, rad/s); the robot no longer waits."""
        self.cmd_vel_nav.publish(Twist.of(v, w))
        self._waiting.resume()
        self._publish_waiting()

    def _stop(self) -> None:
        self._drive(0.0, 0.0)
        self.end_reports()

    def _publish_waiting(self) -> None:
        notice = self._waiting.new_notice()
        if notice:
            self.wait_reason.publish(String(self._waiting.reason))
            self.notice.publish(String(notice))
