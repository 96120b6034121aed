"""Drives what a calibration needs, and keeps what was measured on the way."""

from __future__ import annotations

import math
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from chefbot.calibration.alignment import placed
from chefbot.calibration.drive import Leg, Square, Stand
from chefbot.calibration.surface import Surface
from chefbot.calibration.wiring import explained, miswired
from chefbot.maths.angles import wrap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.diagnostic_msgs import ERROR, DiagnosticArray
from chefbot.msgs.geometry_msgs import Point, Twist
from chefbot.msgs.nav2_msgs import DriveOnHeading, DriveOnHeading_Goal, Spin, Spin_Goal
from chefbot.msgs.sensor_msgs import Imu, LaserScan
from chefbot.msgs.std_msgs import Bool, String
from chefbot.nodes.scan_tracker import ScanTracker
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.runtime.actions import calls
from chefbot.runtime.coroutines import Cancelled, Future
from chefbot.runtime.node import In, Node, Out, every, topic
from chefbot.scan.usable_range import trusted_range

SPEED = 0.8
"""Of the robot's best: wheels that are not at their limit slip less."""
LOOKS = 10
"""Scans at each stand; their mean is what is matched."""
SETTLE = 0.6
"""s between the end of a motion and the first look."""
PATIENCE = 5.0
"""s without a scan, or until the first one, after which it gives up."""
SIDES = (2.5, 2.0, 1.5, 1.0)
"""m, the first that has room."""
MARGIN = 0.25
"""m between the robot's rim on its square and the nearest thing."""
OWN = 0.05
"""m beyond its rim where a lidar may still take its own tubes for walls."""
STEADY, JUMP = 0.7, 0.06
"""Share of a stand's scans in which a beam must end, and share of the distance (from 1 m on) by which these may
differ: at edges some scans see what is in front and some what is behind."""
LEAST_SEEN = 0.1
"""Share of beams that must see a wall."""
PROBE, PROBE_TURN = 0.15, 0.6
"""m and rad of the first careful motions, which tell whether wheels, encoders and gyro are wired as they should."""
NEAR, STRAIGHT_ON = 0.03, math.radians(1.5)
"""m and rad that count as back at the start of a square."""


class CalibratorParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How much it drives."""

    squares: Annotated[
        int, Meta(ge=1, le=20, description="squares each way to calibrate by, and as many to check it")
    ] = 4
    side: Annotated[
        float, Meta(ge=0, le=10, description="of the squares, m; 0: as large as there is room")
    ] = 0.0
    settle: Annotated[float, Meta(ge=0, le=5, description="pause before the first look of a stand, s")] = (
        SETTLE
    )


class GaveUp(Exception):  # noqa: N818 (the caller makes it a sentence for people)
    """Why the drive ended early, in a sentence."""


class CalibratorNode(Node):
    """Turns, then squares both ways, twice: to calibrate by, and to tell how well that went.

    At each stand it looks at the walls; legs from stand to stand are in `legs` and `checks`. A robot that is stopped,
    driven by a person, blocked, or blind stands still and says so in `failure`.
    """

    params: CalibratorParams
    scan: In[LaserScan]
    wheel_ticks: In[WheelTicks]
    imu: In[Imu] = topic("imu/data")
    cmd_vel_teleop: In[Twist]
    emergency_stop: In[Bool]
    diagnostics: In[DiagnosticArray]
    spin = calls(Spin)
    drive_on_heading = calls(DriveOnHeading)
    remark: Out[String] = topic("calibration/remark")

    def start(self) -> None:
        """Begin at once."""
        import scipy.spatial  # noqa: F401 (half a second, before wheels turn rather than at the first stand)

        self.legs: list[Leg] = []
        self.squares: list[Square] = []
        self.checks: list[Square] = []
        self.failure: str | None = None
        self.finished = False
        self._reach = trusted_range(self.robot, 0.05)
        self._tracker = ScanTracker(self._reach)
        self.stands: list[Stand] = []
        self._surfaces: list[Surface] = []
        self._room_T_tracker = IDENTITY
        self._looks: list[tuple[SE2, LaserScan]] | None = None
        self._looked: Future[None] = Future()
        self._here = IDENTITY
        self._scan_ns = self.now_ns
        self._forget()
        self._task = self.spawn(self._work())

    # -- what is measured

    def _forget(self) -> None:
        """A new leg begins."""
        self._ticks: list[tuple[int, int]] = self._ticks[-1:] if hasattr(self, "_ticks") else []
        self._turned = self._gyro_seconds = 0.0

    def on_wheel_ticks(self, ticks: WheelTicks) -> None:
        """Keep the counts."""
        self._ticks.append((ticks.left, ticks.right))

    def on_imu(self, imu: Imu) -> None:
        """Add up the turn; a rate is the mean since the last message."""
        stamp = imu.header.stamp.ns
        last = getattr(self, "_imu_ns", None)
        self._imu_ns = stamp
        if last is not None and 0 < stamp - last < 1_000_000_000:
            self._turned += imu.angular_velocity.z * (stamp - last) / 1e9
            self._gyro_seconds += (stamp - last) / 1e9

    def on_scan(self, scan: LaserScan) -> None:
        """Wait until odometry has reached its time."""
        self._scan_ns = self.now_ns
        self.tf.when("odom", scan.header.frame_id, scan.header.stamp.ns, lambda at: self._look(scan, at))

    def _look(self, scan: LaserScan, moved: SE2) -> None:
        tracked = self._tracker.add(scan.angles, scan.ranges, moved, scan.range_max)
        self._here = self._room_T_tracker @ tracked
        if self._looks is None or len(self._looks) >= LOOKS:
            return
        self._looks.append((self._here, scan))
        if len(self._looks) == LOOKS:
            self._looked.set(None)

    def _walls(self, scans: list[LaserScan]) -> NDArray[np.float64]:
        """(n, 2) in the sensor's frame: ends of beams that nearly every scan saw at one distance, not on itself."""
        ranges = np.array([scan.ranges for scan in scans], np.float64)
        ranges[~((ranges > 0.0) & (ranges < min(self._reach, scans[0].range_max)))] = np.nan
        good = np.isfinite(ranges).sum(axis=0) >= STEADY * len(scans)
        mean, angles = np.nanmean(ranges[:, good], axis=0), scans[0].angles[good].astype(np.float64)
        steady = np.nanmax(np.abs(ranges[:, good] - mean), axis=0) < JUMP * np.maximum(mean, 1.0)
        points = (mean * (np.cos(angles), np.sin(angles))).T[steady]
        beyond = np.hypot(*self.mount.apply(points).T) > self.robot.footprint_radius + OWN
        self._seen = float(good.mean())
        return np.asarray(points[beyond])

    # -- who may stop it

    def on_emergency_stop(self, pressed: Bool) -> None:
        """It does not go on by itself."""
        if pressed.data:
            self._give_up("the emergency stop was pressed")

    def on_cmd_vel_teleop(self, twist: Twist) -> None:
        """A person takes over."""
        if twist.linear.x or twist.angular.z:
            self._give_up("a person drives the robot")

    def on_diagnostics(self, array: DiagnosticArray) -> None:
        """A board that has stopped its motors."""
        for status in array.status:
            if status.name == "board" and status.level == ERROR and self._moving:
                counted = np.ptp(np.array(self._ticks or [(0, 0)]), axis=0)
                self._give_up(explained(status.message, int(counted[0]), int(counted[1])))

    @every(hz=2)
    def watch(self) -> None:
        """A robot that sees nothing does not drive."""
        if self.now_ns - self._scan_ns > PATIENCE * 1e9:
            self._give_up(
                f"no scans for {PATIENCE:.0f} s; the launch needs the driver of a lidar or of a depth camera"
            )

    def _give_up(self, why: str) -> None:
        if not self._over:
            self.failure = why
            self._task.cancel()

    @property
    def _over(self) -> bool:
        return self.finished or self.failure is not None

    # -- the drive

    _moving = False

    async def _work(self) -> None:
        try:
            await self._drive()
            self.finished = True
        except GaveUp as reason:
            self.failure = self.failure or str(reason)
        except Cancelled:
            self.failure = self.failure or "the drive was broken off"
            raise

    async def _drive(self) -> None:
        self._tell("Stand clear. The robot turns on the spot, then drives squares; STOP or any key ends it.")
        await self._stand()
        await self._probe()
        await self._look_round(1)
        side = self._side()
        for turn in (-1.0, 1.0):
            await self._turn(turn * 2.0 * math.pi)
            await self._stand_and_keep()
        await self._look_round(-1)
        home = self._here
        for squares, about in ((self.squares, "to calibrate by"), (self.checks, "to check it")):
            for number in range(2 * self.params.squares):
                way = "left" if number % 2 == 0 else "right"
                self._tell(
                    f"Square {number + 1} of {2 * self.params.squares} {about}, {side} m, to the {way}."
                )
                squares.append(await self._square(home, side, 1 if number % 2 == 0 else -1))

    async def _probe(self) -> None:
        """A little forward and back, a little left and right: what counts and turns the wrong way is said."""
        if self._seen < LEAST_SEEN:
            raise GaveUp(
                f"the sensor sees walls with {100 * self._seen:.0f} % of its beams within {self._reach:.0f} m; "
                "calibrate in a room"
            )
        for metres, angle in ((PROBE, 0.0), (0.0, PROBE_TURN), (0.0, -PROBE_TURN), (-PROBE, 0.0)):
            await (self._straight(metres) if metres else self._turn(angle))
            leg = await self._stand_and_keep()
            sentence = miswired(leg, metres, angle)
            if sentence:
                raise GaveUp(sentence)

    async def _look_round(self, turn: int) -> None:
        """A whole turn in steps of half a view, so that each look sees half of what the last one saw."""
        pieces = math.ceil(2.0 * math.pi / (0.5 * min(self._view(), math.pi)))
        for _ in range(pieces):
            await self._turn(turn * 2.0 * math.pi / pieces)
            await self._stand_and_keep()

    def _view(self) -> float:
        """Of the sensor that scans, rad."""
        scan = self.scan.last
        return 2.0 * math.pi if scan is None else scan.angle_max - scan.angle_min

    async def _square(self, home: SE2, side: float, turn: int) -> Square:
        """Around the same ground both ways; to the right it begins along what is the last side to the left."""
        await self._go(home if turn > 0 else home @ SE2(0.0, 0.0, math.pi / 2))
        legs = []
        for _ in range(4):
            await self._straight(side)
            legs.append(await self._stand_and_keep())
            await self._turn(turn * math.pi / 2)
            legs.append(await self._stand_and_keep())
        return Square(turn, side, tuple(legs))

    async def _go(self, target: SE2) -> None:
        """Back to a place by the scans."""
        for _ in range(3):
            way = self._robot_here().between(self._robot_at(target))
            distance = math.hypot(way.x, way.y)
            if distance > NEAR:
                bearing = math.atan2(way.y, way.x)
                backwards = abs(bearing) > math.pi / 2
                await self._turn(wrap(bearing + math.pi) if backwards else bearing)
                await self._straight(-distance if backwards else distance)
                await self._stand_and_keep()
            left = wrap(target.yaw - self._here.yaw)
            if abs(left) > STRAIGHT_ON:
                await self._turn(left)
                await self._stand_and_keep()
            elif distance <= NEAR:
                return

    def _robot_here(self) -> SE2:
        return self._robot_at(self._here)

    def _robot_at(self, sensor: SE2) -> SE2:
        return sensor @ self.mount.inverse()

    @property
    def mount(self) -> SE2:
        """Where the sensor that scans is on the robot, by the robot file."""
        frame = self.scan.last.header.frame_id if self.scan.last else "base_link"
        return self.tf.lookup("base_link", frame)

    async def _straight(self, metres: float) -> None:
        allowed = Duration.of(10.0 + 4.0 * abs(metres) / (SPEED * max_speed(self.robot)))
        self._moving = True
        speed = math.copysign(SPEED * max_speed(self.robot), metres)
        result = await self.drive_on_heading.call(DriveOnHeading_Goal(Point(metres), speed, allowed))
        self._check(result.error_code, result.error_msg)

    async def _turn(self, angle: float) -> None:
        if abs(angle) < 0.03:
            return
        allowed = Duration.of(10.0 + 4.0 * abs(angle) / max_turn(self.robot))
        self._moving = True
        result = await self.spin.call(Spin_Goal(angle, allowed))
        self._check(result.error_code, result.error_msg)

    @staticmethod
    def _check(code: int, sentence: str) -> None:
        if code:
            raise GaveUp(f"the robot did not get on: {sentence[:1].lower()}{sentence[1:].rstrip('.')}")

    async def _stand(self) -> SE2:
        """Stand still and look; the sensor's place."""
        await self.sleep(self.params.settle)
        self._looks, self._looked = [], Future()
        await self._looked
        looks, self._looks = self._looks, None
        mean = np.array([(p.x, p.y, math.cos(p.yaw), math.sin(p.yaw)) for p, _ in looks]).mean(axis=0)
        tracked = SE2(float(mean[0]), float(mean[1]), math.atan2(mean[3], mean[2]))
        self._place(tracked, self._walls([scan for _, scan in looks]))
        self._forget()
        return self._here

    def _place(self, tracked: SE2, walls: NDArray[np.float64]) -> None:
        """By all stands before: what the tracker believed from scan to scan, by odometry that is wrong yet, adds up
        to 11 degrees and 0.3 m in ten minutes."""
        surface = Surface(walls)
        self._here = placed(surface, tracked, [one.pose for one in self.stands], self._surfaces)
        self._room_T_tracker = self._here @ tracked.inverse() @ self._room_T_tracker
        self.stands.append(Stand(self._here, walls))
        self._surfaces.append(surface)

    async def _stand_and_keep(self) -> Leg:
        """Stand, and keep the leg from the last stand to this one."""
        begin = self.stands[-1].pose
        await self.sleep(self.params.settle)
        ticks, turned, seconds = np.array(self._ticks, np.float64), self._turned, self._gyro_seconds
        end = await self._stand()
        leg = Leg(ticks, turned, seconds, begin, end, (len(self.stands) - 2, len(self.stands) - 1))
        self.legs.append(leg)
        return leg

    def _side(self) -> float:
        """The largest square that has room, to the left of where the robot looks; GaveUp for none."""
        points = self._here.inverse().apply(
            np.concatenate([one.pose.apply(one.walls) for one in self.stands])
        )
        points = self.mount.apply(points)
        room = self.robot.footprint_radius + MARGIN
        wanted = (self.params.side,) if self.params.side else SIDES
        for side in wanted:
            off = np.hypot(*(np.maximum(np.abs(points - side / 2) - side / 2, 0.0)).T)
            if not (off < room).any():
                return side
        raise GaveUp(
            f"there is no room for a square of {wanted[-1]:.1f} m; put the robot in a corner of a free square of "
            f"{wanted[-1] + 2 * room:.1f} m, {room:.1f} m from its edges, looking along one with the room to its left"
        )

    def _tell(self, sentence: str) -> None:
        self.remark.publish(String(sentence))
