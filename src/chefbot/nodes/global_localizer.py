"""Active global localization: turns, and drives where the way is open, until localization has converged."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from chefbot.behavior.open_directions import OpenDirections, OpenWay
from chefbot.behavior.relocalization import SPIN_STEP, SPIN_STEP_GOAL, LocalizationMonitor
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.geometry_msgs import Point
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal, Spin, Spin_Goal
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Bool
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Task, wait_any
from chefbot.runtime.node import In, Node, Out, restored, topic
from chefbot.runtime.transform_buffer import TransformError

MIN_MOVE = 0.3
"""Shortest distance of a move to another view, m."""
VISITED_STEP = 0.5
"""Distance between two places of the way that count as visited, m."""
MOVE_SPEED = 0.25
"""Speed of a move, m/s."""
MOVE_TIME = Duration.of(25.0)
"""Time that a move may take."""
ALL_ROUND_ANGLE = math.pi
"""Angle that a robot that sees all round turns at first, rad; others turn once before each move."""


class GlobalLocalizerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the search for the pose."""

    rounds: Annotated[int, Meta(ge=1, le=100, description="maximum number of search rounds")] = 30


class GlobalLocalizerNode(Node):
    """Turns and drives carefully, by sensors only, until localization has converged for some updates.

    Rooms that are built alike differ in what lies beyond them, so each round drives the open way that leads
    farthest from where the robot has been. The result is published once on `localized`; navigation waits for it.
    """

    params: GlobalLocalizerParams
    localization_status: In[LocalizationStatus]
    scan: In[LaserScan]
    restored_localized: In[Bool] = restored("localized")
    emergency_stop: In[Bool]
    spin = action_client(Spin)
    drive_on_heading = action_client(DriveOnHeading)
    localized: Out[Bool] = topic(latched=True)

    def start(self) -> None:
        """Start the search, unless the robot was localized before a restart."""
        self._localization = LocalizationMonitor()
        self._open = OpenDirections(self.robot.circumscribed_radius)
        self._visited: list[tuple[float, float]] = []
        lidar = self.robot.sensors.lidar
        self._sees_all_round = lidar is not None and lidar.full_turn
        self._task: Task[None] = self.spawn(self._search())

    def on_emergency_stop(self, pressed: Bool) -> None:
        """Cancel the search; it does not resume after the release: the operator may set the initial pose."""
        if pressed.data and not self._task.done:
            self._task.cancel()
            self.localized.publish(Bool(False))

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Count the consecutive updates with converged localization."""
        self._localization.process(status)

    def on_scan(self, scan: LaserScan) -> None:
        """Note where the way is open, while the search lasts."""
        if self._task.done:
            return
        pose = self._pose()
        if pose is None:
            return
        laser = self.tf.lookup("base_link", scan.header.frame_id)
        bearings = np.asarray(scan.angles + laser.yaw, np.float64)
        ranges = scan.ranges.astype(np.float64)
        hits = np.isfinite(ranges)
        angles, far = scan.angles[hits], ranges[hits]
        ends = laser.apply(np.column_stack([far * np.cos(angles), far * np.sin(angles)]))
        bearings[hits], ranges[hits] = np.arctan2(ends[:, 1], ends[:, 0]), np.hypot(ends[:, 0], ends[:, 1])
        self._open.process(bearings, ranges, scan.range_max, pose.yaw)
        if not self._visited or math.dist(self._visited[-1], pose[:2]) > VISITED_STEP:
            self._visited.append(pose[:2])

    async def _search(self) -> None:
        await self.sleep(0.0)  # restored messages are delivered first
        if self.restored_localized.last is not None and self.restored_localized.last.data:
            self.localized.publish(Bool(True))
            return
        await self._turn(ALL_ROUND_ANGLE if self._sees_all_round else 2.0 * math.pi)
        for _ in range(self.params.rounds):
            if self._localization.has_settled:
                break
            await self._move_on()
            await self._turn(0.0 if self._sees_all_round else 2.0 * math.pi)
        self.localized.publish(Bool(self._localization.has_settled))

    async def _turn(self, angle: float) -> None:
        """Turn on the spot, rad, until localization has converged."""
        turned = 0.0
        while not self._localization.has_settled and turned < angle:
            # ends also when another motion preempts it
            await wait_any(self.spin.call(SPIN_STEP_GOAL))
            turned += SPIN_STEP

    async def _move_on(self) -> None:
        """Drive the best open way; if there is none or it is blocked, turn by 120 degrees for the next round."""
        pose = self._pose()
        if pose is not None:
            way = self._open.best(np.array(pose[:2]), np.array([*self._visited, pose[:2]]))
            self._open.clear()
            if way.length >= MIN_MOVE and await self._drives(way, pose.yaw):
                return
            self._give_up(way, pose)
        await self.spin.call(Spin_Goal(2.0 * math.pi / 3.0, Duration.of(15.0)))

    async def _drives(self, way: OpenWay, yaw: float) -> bool:
        """Turn to a way and drive it; return whether that was possible. yaw: of the robot in odom, rad."""
        turned = await self.spin.call(Spin_Goal(wrap(way.heading - yaw), Duration.of(15.0)))
        if turned.error_code:
            return False
        goal = DriveOnHeading_Goal(Point(way.length), MOVE_SPEED, MOVE_TIME)
        return not (await self.drive_on_heading.call(goal)).error_code

    def _give_up(self, way: OpenWay, start: SE2) -> None:
        """Count the places along a way that was blocked as visited, so that another one is tried first."""
        for distance in np.arange(VISITED_STEP, way.length + VISITED_STEP, VISITED_STEP):
            x, y = start.x + distance * math.cos(way.heading), start.y + distance * math.sin(way.heading)
            self._visited.append((x, y))

    def _pose(self) -> SE2 | None:
        try:
            return self.tf.lookup("odom", "base_link")
        except TransformError:
            return None
