"""Backs up along the robot's own track until its depth camera sees what stops it, touches it or blinds the camera."""

from __future__ import annotations

import math

from chefbot.behavior.motion_errors import BACK_UP
from chefbot.behavior.retreat import SEEN_TRACK_TIME_NS, TRACK_TIME_NS, RecentTrack, sight_distance
from chefbot.causes.reports import CAMERA, STOP
from chefbot.costmap.ranger_marks import contact_radius
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import Cause
from chefbot.msgs.geometry_msgs import Point, PoseStamped
from chefbot.msgs.nav2_msgs import BackUp_Goal, BackUp_Result
from chefbot.nodes.causes.motion_reasons import MONITOR
from chefbot.nodes.navigation.recovery_behaviors import RecoveryBehaviorsNode
from chefbot.robot.motion_limits import max_speed
from chefbot.runtime.node import In, every, topic
from chefbot.runtime.transform_buffer import TransformError
from chefbot.safety.obstacle_sensors import BLIND

RECENT_NS = 3_000_000_000
"""Time after its end for which a stop by the collision monitor counts, ns: the controller has given up since."""
NEW_PLACE = 1.0
"""Distance from where the robot has backed up from what blinds its camera, m, at which it does so again."""
TURN_TOLERANCE = 0.1
"""Angle up to which the robot need not rotate first, rad."""
TURN_ALLOWANCE, BACK_UP_ALLOWANCE = 10.0, 30.0
"""Time allowances of the motions, s; the collision monitor lets the robot back slowly."""
NOTHING_REMEMBERED = "No remembered obstacle stops the robot, and it touches none."
NO_TRACK = "The robot has no recent track on which it could back up."


class RetreatingNode(RecoveryBehaviorsNode):
    """Base class of a node that backs up to look at what its collision monitor remembers."""

    monitor_reports: In[Cause] = topic("cause_reports")
    contact: In[PoseStamped]

    def start(self) -> None:
        """Start with no track, no stop, and no contact."""
        super().start()
        lidar = self.robot.sensors.lidar
        sees_behind = lidar is not None and lidar.full_turn
        self._track = RecentTrack(SEEN_TRACK_TIME_NS if sees_behind else TRACK_TIME_NS)
        self._stop = Cause()
        self._stop_ended_ns: int | None = None
        self._touched: tuple[float, float] | None = None
        self._touched_ns = 0
        self._backed_from: SE2 | None = None

    @every(hz=5)
    def record_track(self) -> None:
        """Add the present pose to the track."""
        robot = self._robot_in_odom()
        if robot is not None:
            self._track.add(robot, self.now_ns)

    def on_monitor_reports(self, report: Cause) -> None:
        """Keep the last stop by an obstacle that the depth camera saw."""
        if report.check != MONITOR:
            return
        if report.kind == STOP and report.located and report.sensor == CAMERA:
            self._stop, self._stop_ended_ns = report, None
        elif self._stop_ended_ns is None:
            self._stop_ended_ns = self.now_ns

    def on_contact(self, contact: PoseStamped) -> None:
        """Keep the place that the robot touches, in odom: in front of it, or where its motion was directed."""
        robot = self._robot_in_odom()
        if robot is not None:
            ahead = robot @ contact.pose.se2 @ SE2(contact_radius(self.robot), 0.0, 0.0)
            self._touched, self._touched_ns = (ahead.x, ahead.y), self.now_ns

    async def _back_up_to_see(self) -> BackUp_Result:
        """Back up until the camera sees the place of the obstacle that stops the robot; an error if none does."""
        robot, place = self._robot_in_odom(), self._remembered_place()
        camera = self.robot.sensors.depth_camera
        if robot is None or place is None or camera is None:
            return _failed(BACK_UP.unknown, NOTHING_REMEMBERED)
        retreat = self._track.retreat(robot, *place, sight_distance(camera))
        if retreat is None:
            return _failed(BACK_UP.unknown, NO_TRACK)
        self._begin_recovery()
        await self._turn(retreat.turn)
        result = await self._back_along_track(retreat.distance)
        if not result.error_code:
            await self._turn(retreat.turn_to_place)
        return result

    async def _back_along_track(self, distance: float) -> BackUp_Result:
        """Back up over ground that the body covered a moment ago, in odom: that needs no localization."""
        goal = BackUp_Goal(Point(-distance), max_speed(self.robot), Duration.of(BACK_UP_ALLOWANCE))
        return await self._motion_result(self.backup.call(goal), BACK_UP_ALLOWANCE, _failed, BACK_UP)

    async def _turn(self, angle: float) -> None:
        if abs(angle) > TURN_TOLERANCE:
            await self._spin_by(angle, TURN_ALLOWANCE)

    def _remembered_place(self) -> tuple[float, float] | None:
        """Return where the obstacle is that the robot touches, or that blinds its camera or has just stopped it."""
        if self._touched is not None and self.now_ns - self._touched_ns <= RECENT_NS:
            return self._touched
        if BLIND in self._limit:
            return self._place_too_near()
        ended_ns, point = self._stop_ended_ns, self._stop.point
        if not self._stop.located or (ended_ns is not None and self.now_ns - ended_ns > RECENT_NS):
            return None
        return (point.x, point.y) if math.isfinite(point.x + point.y) else None

    def _place_too_near(self) -> tuple[float, float] | None:
        """Return the place ahead that may be too near for a blind camera; None if it has backed up here before."""
        robot, before = self._robot_in_odom(), self._backed_from
        if robot is None or (before is not None and robot.distance(before) < NEW_PLACE):
            return None
        self._backed_from = robot
        ahead = robot @ SE2(contact_radius(self.robot), 0.0, 0.0)
        return ahead.x, ahead.y

    def _robot_in_odom(self) -> SE2 | None:
        try:
            return self.tf.lookup("odom", "base_link")
        except TransformError:
            return None

    def _begin_recovery(self) -> None:
        """Count a recovery behavior."""


def _failed(error_code: int, error_msg: str) -> BackUp_Result:
    return BackUp_Result(error_code=error_code, error_msg=error_msg)
