"""What a node that drives reports of each cycle: what blocks it, what slows it down, and what it leads around."""
# ruff: noqa: ARG002 (a controller with the interface of all)

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from tests.support.nodes import ROBOT, NodeRunner

from chefbot.behavior.behavior import BehaviorProgress
from chefbot.causes.reports import CAMERA, DETOUR, LIDAR, SLOW, STOP, TRACKER
from chefbot.control.controller import ControllerCommand, ControllerStatus
from chefbot.control.path_follower import PathFollower
from chefbot.control.people_cost import NearbyPeople
from chefbot.costmap.params import LOCAL_COSTMAP, CostmapParams
from chefbot.costmap.sources import CAMERA as CAMERA_LAYER
from chefbot.costmap.sources import LASER
from chefbot.maths.costs import LETHAL, Costmap
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import Cause, LocalizationStatus
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, TransformStamped
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.causes.local_causes import LocalCausesNode
from chefbot.robot.motion_limits import Limits
from chefbot.runtime.node import every
from chefbot.safety.params import SensorName

PERIOD = 0.1
SPEED = Limits.of(ROBOT).speed
Path = NDArray[np.float64]


class DriverParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters that a node with a local costmap must have."""

    costmap: CostmapParams = LOCAL_COSTMAP
    optional_sensors: tuple[SensorName, ...] = ()


class Driver(LocalCausesNode):
    """A node that reports what a test lets it meet."""

    params: DriverParams

    @every(hz=20)
    def pass_time(self) -> None:
        """Let the time of the loop go on."""


class Fixed:
    """A controller that commands the same each time."""

    def __init__(self, v: float, status: ControllerStatus) -> None:
        self._command = ControllerCommand(v, 0.0, status)

    def set_path(self, path: Path, *, same_goal: bool = False) -> None:
        """Follow none."""

    def command(
        self, pose: SE2, twist: tuple[float, float], costmap: Costmap, people: NearbyPeople
    ) -> ControllerCommand:
        return self._command


def straight(length: float, y: float = 0.0) -> Path:
    """Return a path ahead of the robot."""
    xs = np.arange(0.0, length + 1e-9, 0.05)
    return np.column_stack([xs, np.full_like(xs, y), np.zeros_like(xs)])


def aside(length: float, away: float) -> Path:
    """Return a path that leads to the same end by some metres to the left."""
    path = straight(length)
    path[:, 1] = away * np.sin(np.pi * path[:, 0] / length)
    return path


class Drive:
    """A robot at the origin of odom, which looks along x, and the costmap around it."""

    def __init__(self) -> None:
        self.runner = NodeRunner({"driver": f"{__name__}:Driver"}, {})
        self.node: Any = self.runner.system.nodes["driver"]
        self.blind = ""
        transform = TransformStamped.of(0, "odom", "base_link", IDENTITY)
        self.publish("tf_static", TFMessage((transform,)))

    def publish(self, topic: str, message: Any) -> None:
        self.runner.loop.publish(topic, message, "test", from_device=True)
        self.runner.run(0.05)

    def mark(self, layer: str, *places: tuple[float, float]) -> None:
        """Mark cells, at 1.5 s."""
        costs = self.node._costs
        costs.set_time(1.5)
        for x, y in places:
            cell = int((y - costs.origin_y) // 0.05), int((x - costs.origin_x) // 0.05)
            costs.source_cells(layer)[cell] = LETHAL
            costs.note_marks(layer, cell)
        costs.note_all_changed()

    def follow(
        self,
        v: float = 0.3,
        status: ControllerStatus = ControllerStatus.RUNNING,
        *,
        path: Path | None = None,
        replanned: Path | None = None,
        cycles: int = 1,
        person: tuple[float, float] | None = None,
    ) -> list[Cause]:
        """Run cycles of a controller that commands v, with a person who stands somewhere, and return all reports."""
        given = straight(1.5) if path is None else path

        def replan(path: Path, pose: SE2, costmap: Costmap) -> Path:
            return path if replanned is None else replanned

        follower = PathFollower(Fixed(v, status), replan, PERIOD)
        follower.set_path(given, IDENTITY, following=False)
        for _ in range(cycles):
            if person is not None:
                self.publish("tracked_people", self._standing(*person))
            costs = self.node._costs.update()
            step = follower.step(IDENTITY, (v, 0.0), costs, self.blind)
            self.node.report_step(step, follower, IDENTITY, costs, self.blind)
            self.runner.run(PERIOD)
        return self.reports

    def _standing(self, x: float, y: float) -> TrackedPeople:
        covariance = 0.001 * np.eye(4).reshape(16)
        person = TrackedPerson(5, Point(x, y), covariance=covariance, visible=True)
        return TrackedPeople(Header.of(self.runner.loop.now_ns, "odom"), (person,))

    @property
    def reports(self) -> list[Cause]:
        self.runner.run(0.0)
        return self.runner.messages("cause_reports")


def one(reports: list[Cause]) -> Cause:
    (report,) = reports
    return report


def place(cause: Cause) -> tuple[float, float]:
    assert cause.located and cause.header.frame_id == "odom"
    return cause.point.x, cause.point.y


# ---- blocked


def test_a_blocked_controller_names_the_obstacle_on_its_path() -> None:
    drive = Drive()
    drive.mark(CAMERA_LAYER, (0.72, 0.02), (-0.3, 0.0))
    cause = one(drive.follow(0.0, ControllerStatus.BLOCKED))
    assert (cause.kind, cause.check, cause.sensor) == (STOP, "admissible twists", CAMERA)
    assert place(cause) == pytest.approx((0.725, 0.025)) and cause.marked_at.ns == 1_500_000_000


def test_with_nothing_on_the_path_the_nearest_obstacle_is_named() -> None:
    drive = Drive()
    drive.mark(LASER, (-0.31, 0.02), (0.0, 0.6))
    cause = one(drive.follow(0.0, ControllerStatus.BLOCKED))
    assert cause.sensor == LIDAR and place(cause) == pytest.approx((-0.325, 0.025))


def test_a_blocked_controller_on_free_ground_names_no_place() -> None:
    cause = one(Drive().follow(0.0, ControllerStatus.BLOCKED))
    assert cause.check == "admissible twists" and not cause.located and cause.sensor == ""


@pytest.mark.parametrize(("v", "stops"), [(0.3, True), (0.0, False), (-0.2, False)])
def test_a_blind_robot_is_stopped_when_it_would_drive_forward(v: float, stops: bool) -> None:
    drive = Drive()
    drive.mark(CAMERA_LAYER, (0.72, 0.02))
    drive.blind = "The depth camera is covered."
    reports = drive.follow(v)
    assert [(cause.kind, cause.check, cause.sentence) for cause in reports] == (
        [(STOP, "sensor data", drive.blind)] if stops else []
    )


def test_a_stuck_robot_is_reported_once_at_the_end() -> None:
    reports = Drive().follow(0.3, cycles=150)
    checks = [(cause.kind, cause.check) for cause in reports]
    assert checks[:2] == [(STOP, "progress"), ("end", "progress")]
    assert reports[0].sentence == "No progress: the robot is stuck."


# ---- slow


def slow_beside_a_wall(v: float, **drive_on: Any) -> list[Cause]:
    """Return what is reported of a second of driving beside an obstacle."""
    drive = Drive()
    drive.mark(LASER, *[(x, 0.32) for x in np.arange(0.02, 0.6, 0.05)])
    return drive.follow(v, cycles=10, **drive_on)


def test_a_robot_that_drives_slowly_past_an_obstacle_names_it() -> None:
    cause = one(slow_beside_a_wall(0.1))
    assert (cause.kind, cause.check, cause.sensor) == (SLOW, "speed near obstacles", LIDAR)
    assert cause.sentence == "The controller drives at 0.10 m/s past an obstacle."
    assert [(one.name, one.value) for one in cause.numbers] == [
        ("speed", pytest.approx(0.1)), ("possible speed", pytest.approx(SPEED))
    ]  # fmt: skip
    x, y = place(cause)
    assert 0.0 <= x <= 0.2 and y == pytest.approx(0.325)
    assert cause.header.stamp.ns >= 500_000_000, "it begins slowly, too"


@pytest.mark.parametrize(("share", "slow"), [(0.59, True), (0.61, False), (1.0, False)])
def test_slow_is_less_than_three_fifths_of_the_possible_speed(share: float, slow: bool) -> None:
    assert bool(slow_beside_a_wall(share * SPEED)) == slow


def test_standing_and_reversing_are_not_slow_driving() -> None:
    assert slow_beside_a_wall(0.0) == slow_beside_a_wall(0.02) == slow_beside_a_wall(-0.1) == []


def test_a_robot_slows_down_before_its_goal_without_a_cause() -> None:
    """At a distance d from the goal, sqrt(a d) is what it may drive."""
    acceleration = Limits.of(ROBOT).acceleration
    near = straight(0.1)
    possible = np.sqrt(acceleration * 0.1)
    assert slow_beside_a_wall(0.62 * possible, path=near) == []
    assert len(slow_beside_a_wall(0.58 * possible, path=near)) == 1


def test_the_limit_of_a_slow_zone_is_not_an_obstacle() -> None:
    for limit, slow in ((0.15, False), (0.2, True), (0.0, True)):
        drive = Drive()
        drive.publish("speed_limit", SpeedLimit(speed_limit=limit))
        drive.mark(LASER, *[(x, 0.32) for x in np.arange(0.02, 0.6, 0.05)])
        assert bool(drive.follow(0.1, cycles=10)) == slow


def test_an_obstacle_far_beside_slows_nobody_down() -> None:
    drive = Drive()
    drive.mark(LASER, (0.1, 0.5))
    assert drive.follow(0.1, cycles=10) == []


def test_a_person_near_the_trajectory_comes_before_an_obstacle() -> None:
    drive = Drive()
    drive.mark(LASER, (0.1, 0.32))
    cause = one(drive.follow(0.1, cycles=8, person=(0.3, 0.6)))
    assert (cause.kind, cause.check, cause.sensor) == (SLOW, "speed near people", TRACKER)
    assert place(cause) == pytest.approx((0.3, 0.6))
    assert cause.sentence == "The controller drives at 0.10 m/s near a person."
    assert drive.follow(SPEED, cycles=8, person=(0.3, 0.6))[1:][0].kind == "end", "fast enough past somebody"


# ---- detours


def test_a_local_detour_names_the_obstacle_on_the_given_path() -> None:
    drive = Drive()
    drive.mark(CAMERA_LAYER, (0.72, 0.02), (0.2, 0.9))
    cause = one(drive.follow(replanned=aside(1.5, 0.4)))
    assert (cause.kind, cause.check, cause.sensor) == (DETOUR, "local path", CAMERA)
    assert place(cause) == pytest.approx((0.725, 0.025))
    assert cause.numbers[0].name == "deviation" and cause.numbers[0].value == pytest.approx(0.4, abs=0.01)
    assert cause.sentence == "The controller deviates 0.40 m from the path."


@pytest.mark.parametrize(("away", "marked"), [(0.1, True), (0.4, False)])
def test_small_deviations_and_free_paths_are_not_detours(away: float, marked: bool) -> None:
    drive = Drive()
    if marked:
        drive.mark(CAMERA_LAYER, (0.72, 0.02))
    assert drive.follow(replanned=aside(1.5, away)) == []


def test_a_detour_ends_half_a_second_after_the_path_is_straight() -> None:
    drive = Drive()
    drive.mark(CAMERA_LAYER, (0.72, 0.02))
    drive.follow(replanned=aside(1.5, 0.4))
    assert [cause.kind for cause in drive.follow(cycles=8)] == [DETOUR, "end"]


# ---- waiting, and motions of behaviors


def test_waiting_for_localization_has_its_numbers() -> None:
    drive = Drive()
    drive.node.report_waiting("Localization is lost.")
    assert one(drive.reports).check == "localization" and one(drive.reports).numbers == ()
    drive = Drive()
    drive.publish("localization_status", LocalizationStatus(localized=False, probability=0.25, std_xy=0.5))
    drive.node.report_waiting("Localization is lost.")
    cause = one(drive.reports)
    assert cause.kind == STOP and cause.sentence == "The controller waits: Localization is lost."
    assert [(one.name, one.value, one.unit) for one in cause.numbers] == [
        ("probability", 0.25, ""), ("std_xy", 0.5, "m")
    ]  # fmt: skip


def test_waiting_for_a_sensor_names_no_localization() -> None:
    drive = Drive()
    drive.node.report_waiting("The lidar is silent.")
    cause = one(drive.reports)
    assert (cause.check, cause.sentence) == ("sensor data", "The controller waits: The lidar is silent.")


def test_a_blocked_motion_of_a_behavior_names_what_is_nearest() -> None:
    drive = Drive()
    drive.mark(LASER, (-0.31, 0.02), (0.6, 0.0))
    costs = drive.node._costs.update()
    drive.node.report_motion(BehaviorProgress.RUNNING, IDENTITY, costs, "")
    assert drive.reports == []
    drive.node.report_motion(BehaviorProgress.BLOCKED, IDENTITY, costs, "")
    begin, end = drive.reports
    assert (begin.kind, begin.check, begin.sentence) == (
        STOP, "motion of a behavior", "A recovery motion is blocked."
    )  # fmt: skip
    assert place(begin) == pytest.approx((-0.325, 0.025)) and end.kind == "end"


def test_a_blind_motion_of_a_behavior_names_the_sensor_only() -> None:
    drive = Drive()
    drive.mark(LASER, (-0.31, 0.02))
    drive.node.report_motion(
        BehaviorProgress.BLOCKED, IDENTITY, drive.node._costs.update(), "The camera is covered."
    )
    assert drive.reports[0].sentence == "A recovery motion is blocked. The camera is covered."
    assert not drive.reports[0].located
