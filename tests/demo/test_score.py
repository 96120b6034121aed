"""Scoring of a run and its report."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.pillar_room import ANGLES, CORNERS, circle, ranges_at

from chefbot.demo import report
from chefbot.demo.operator_node import OperatorDevice
from chefbot.demo.score import ARRIVAL_TOLERANCE, Scorer, Track, error_statistics, simulated_click
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import Collision, DeliveryStatus, NavigationStatus
from chefbot.msgs.chefbot_msgs.maps import MapTrajectory
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid, Odometry
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.scans.drive_messages import DriveMessages
from chefbot.robot.load import load_robot
from chefbot.runtime.transform_buffer import TransformError
from chefbot.sim.world.load import load_any_world
from chefbot.slam.params import GmappingParams

PLACES = {"home": SE2(0.0, 0.0, 0.0), "table_1": SE2(3.0, 0.0, 0.0)}


class Transforms:
    """Odometry that is off by 0.1 m, on a map at the origin of odom once it is known."""

    def __init__(self) -> None:
        self.truth, self.known = SE2(0.0, 0.0, 0.0), True

    def on_available(self, _: str, __: str, ___: int, callback: Any) -> None:
        callback(SE2(self.truth.x + 0.1, self.truth.y, self.truth.yaw))

    def lookup(self, _: str, __: str) -> SE2:
        if not self.known:
            raise TransformError("no map")
        return SE2(0.0, 0.0, 0.0)


def scorer() -> tuple[Scorer, Transforms]:
    transforms: Any = Transforms()
    system: Any = SimpleNamespace(transforms=transforms)
    return Scorer(system, PLACES), transforms


def publish(one: Scorer, topic: str, message: Message) -> None:
    publication: Any = SimpleNamespace(topic=topic, message=message, time_ns=0)
    one(publication)


def publish_drive(one: Scorer, continued: bool) -> None:
    """Publish a drive of a mapper on a circle in a room, and its trajectory."""
    messages = DriveMessages(GmappingParams(), IDENTITY, IDENTITY, continued=continued)
    poses = circle(1.0)[::5]
    for pose in poses:
        angles = float(ANGLES[0]), float(ANGLES[-1]), float(ANGLES[1] - ANGLES[0])
        scan = LaserScan(Header.of(0, "laser"), *angles, 0.0, 0.1, 0.1, 12.0, ranges_at(pose))
        publish(one, "mapped_scan", messages.next(scan, pose, used=True))
    flat = np.array([pose.array() for pose in poses]).reshape(-1)
    publish(one, "map_trajectory", MapTrajectory(Header.of(0, "map"), flat))


def test_the_final_map_has_its_poses_adjusted() -> None:
    """That of a mapper which publishes its drive, and has not lost a part of it by a restart."""
    one, _ = scorer()
    assert one.final_map() is None
    grid = OccupancyGrid.of(Header.of(0, "map"), Grid(np.full((4, 4), -1, np.int8), 0.05, 0.0, 0.0))
    publish(one, "map", grid)
    unmapped = one.final_map()
    assert unmapped is not None and (unmapped.cells == -1).all()
    publish_drive(one, continued=False)
    found = one.final_map()
    assert found is not None and found.at(0.0, 1.0) < 25 and found.at(*CORNERS[:2]) > 50
    publish_drive(one, continued=True)
    assert np.array_equal(one.final_map().cells, grid.grid.cells)  # type: ignore[union-attr]
    publish_drive(one, continued=False)
    assert np.array_equal(one.final_map().cells, found.cells)  # type: ignore[union-attr]


def move(one: Scorer, transforms: Transforms, x: float, stamp: int = 0) -> None:
    transforms.truth = SE2(x, 0.0, 0.0)
    pose = PoseWithCovariance(Pose.of(transforms.truth))
    publish(one, "ground_truth", Odometry(Header.of(stamp, "world"), "base_link", pose))


def test_path_length_and_error_are_those_of_the_ground_truth() -> None:
    one, transforms = scorer()
    for k in range(11):
        move(one, transforms, 0.3 * k, k * 1_000_000_000)
    assert one.path_length == pytest.approx(3.0)
    assert one.mapping.times == pytest.approx(range(11))
    assert one.mapping.errors() == pytest.approx(np.full(11, 0.1))
    one.phase = "localizing"
    move(one, transforms, 0.0)
    assert len(one.mapping.times) == 11 and one.delivering.times == []
    one.phase, transforms.known = "delivering", False
    move(one, transforms, 0.0)
    assert one.delivering.times == [], "there is no estimate without a map"


@given(st.floats(-1.0, 1.0))
def test_a_delivery_counts_at_the_true_place_only(offset: float) -> None:
    one, transforms = scorer()
    move(one, transforms, 3.0 + offset)
    publish(one, "delivery_status", DeliveryStatus(state="driving", place="table_1"))
    publish(one, "delivery_status", DeliveryStatus(state="waiting", place="table_1"))
    near = one.last_ground_truth.distance(PLACES["table_1"]) <= ARRIVAL_TOLERANCE
    assert one.delivered == ["table_1"] * near and not one.at_home()


@given(st.lists(st.lists(st.integers(0, 3), max_size=4).map(sorted), max_size=4))
def test_recoveries_add_up_over_several_goals(goals: list[list[int]]) -> None:
    one, total = scorer()[0], 0
    for counts in goals:
        publish(one, "navigation_status", NavigationStatus(recoveries=0))
        for count in counts:
            publish(one, "navigation_status", NavigationStatus(recoveries=count))
        total += max(counts, default=0)
    publish(one, "collision", Collision(object_name="wall"))
    assert one.recoveries == total and one.collisions == ["wall"]


@given(st.lists(st.floats(0.0, 5.0), max_size=30))
def test_error_statistics_are_ordered(errors: list[float]) -> None:
    found = error_statistics(np.array(errors))
    if not errors:
        assert set(found.values()) == {None}
    else:
        median, p95, maximum = (float(found[key] or 0.0) for key in ("median", "p95", "max"))
        assert median <= p95 <= maximum == pytest.approx(max(errors), abs=1e-4)


@given(st.integers(0, 999), st.floats(-3.0, 3.0))
def test_a_simulated_click_is_off_by_the_stated_amounts(seed: int, yaw: float) -> None:
    truth = SE2(1.0, 2.0, yaw)
    click = simulated_click(truth, np.random.default_rng(seed))
    assert click.distance(truth) == pytest.approx(0.5)
    assert abs(click.yaw - truth.yaw) == pytest.approx(math.radians(20.0))


def test_the_report_escapes_texts_and_embeds_pictures() -> None:
    result: Any = SimpleNamespace(
        table=lambda: [("Path <m>", "3 & 4")], success=False, failure="<b>stuck</b>", robot="r", world="w",
        seed=1, left_unexplored=["(1, 2) 0.5 m: a <door>"],
    )  # fmt: skip
    page = report._page(result, {"Map": b"\x89PNG"})
    assert "<b>" not in page and "&lt;b&gt;stuck" in page and "a &lt;door&gt;" in page
    assert "data:image/png;base64,iVBORw" in page
    grid = Grid(np.array([[0, 100], [-1, 50]], np.int8), 0.05, 0.0, 0.0)
    track = Track([0.0, 1.0], [SE2(0.0, 0.0, 0.0)] * 2, [SE2(0.1, 0.0, 0.0)] * 2)
    for picture in (
        report._maps(grid, None, {"home": IDENTITY}),
        report._trajectory(grid, track),
        report._errors(track),
    ):
        assert picture.startswith(b"\x89PNG")


def test_places_are_drawn_in_the_frame_of_the_map(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Its origin is the start of the robot, which need not be that of the world."""
    drawn: list[Any] = []
    monkeypatch.setattr(report, "_draw_places", lambda _, places: drawn.append(places))
    monkeypatch.setattr(report, "_page", lambda *_: "")
    robot = load_robot("chefbot_lidar")
    world = load_any_world("room", robot, "[1.0, 0.6, 1.57]")
    in_map = {name: world.start.between(pose) for name, pose in world.places.items()}
    scorer: Any = SimpleNamespace(saved_map=None, places=in_map, mapping=Track(), delivering=Track())
    result: Any = SimpleNamespace()
    report.write_report(tmp_path, result, scorer, world, robot)
    assert drawn == [in_map] * 2 and in_map["home"].distance(world.places["home"]) > 1.0


def test_the_report_has_one_line_for_each_reason() -> None:
    regions = ["(1, 2) 0.1 m: too small", "(3, 4) 1.0 m: unreachable", "(5, 6) 0.2 m: too small"]
    assert report.by_reason(regions) == [
        "too small: (1, 2) 0.1 m; (5, 6) 0.2 m",
        "unreachable: (3, 4) 1.0 m",
    ]


def test_the_operator_declares_what_the_demo_publishes() -> None:
    outputs = {name for name, kind in OperatorDevice.__annotations__.items() if str(kind).startswith("Out")}
    assert {"order", "loaded", "taken", "initialpose", "phase"} <= outputs
