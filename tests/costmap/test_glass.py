"""Walls of glass, which a lidar measures at a right angle only, in the scans of a moving robot and in its costmap."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.support.glass_scans import ANGLES, FAR, PERIOD, drive, post, scan_of, wall

from chefbot.costmap.glass_detection import GlassDetector, GlassPoints
from chefbot.costmap.glass_layer import GlassLayer
from chefbot.costmap.layer import CostmapLayer, LayerSettings
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import LOCAL_COSTMAP
from chefbot.costmap.sources import GLASS, LASER
from chefbot.maths.costs import LETHAL
from chefbot.maths.footprint import disc
from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.robot.load import load_robot
from chefbot.runtime.plugins import load_plugin

Floats = NDArray[np.float64]
NOISE = 0.01


def detect(
    scans: list[tuple[SE2, Floats]], seed: int = 0, period: float = PERIOD, holes: float = 0.0
) -> list[GlassPoints]:
    """Return all glass that a detector finds in scans with noise, in a room with walls at x = -FAR and FAR.

    holes: share of the beams that are invalid, as in a scan without skew.
    """
    rng, detector, found = np.random.default_rng(seed), GlassDetector(), []
    for step, (pose, ranges) in enumerate(scans):
        room = np.minimum(wall(pose, FAR, glass=False), wall(pose, -FAR, glass=False))
        noisy = np.minimum(ranges, room) + rng.normal(0.0, NOISE, len(ANGLES))
        noisy[rng.random(len(ANGLES)) < holes] = np.nan
        found += detector.process(pose, ANGLES, noisy, step * period)
    return found


@settings(deadline=None, max_examples=40)
@given(
    x=st.floats(0.4, 3.0),
    period=st.sampled_from([0.02, 0.1, 0.15]),
    speed=st.floats(0.1, 0.5),
    yaw=st.floats(-2.5, 2.5),
    side=st.sampled_from([-1.0, 1.0]),
    seed=st.integers(0, 1000),
    holes=st.sampled_from([0.0, 0.1]),
)
def test_glass_beside_a_drive_is_found(
    x: float, period: float, speed: float, yaw: float, side: float, seed: int, holes: float
) -> None:
    foot = (0.0 if side > 0.0 else math.pi) - yaw
    if abs(math.remainder(foot - math.pi, math.tau)) < 0.3:
        return  # behind the first and the last beam
    scans = [(pose, wall(pose, side * x, glass=True)) for pose in drive(speed, 1.2, yaw, period)]
    points = np.vstack([glass.points for glass in detect(scans, seed, period, holes)])
    assert np.abs(points[:, 0] - side * x).max() < 5.0 * NOISE
    assert points[:, 1].min() < 0.3 and points[:, 1].max() > 0.8  # all that the robot has passed


@pytest.mark.parametrize("radius", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize("x", [0.5, 1.0, 1.8])
def test_posts_and_legs_are_not_glass(radius: float, x: float) -> None:
    places = [(x, y) for y in (-0.5, 0.0, 0.6, 1.1, 1.9)]
    scans = [
        (pose, np.min([post(pose, *place, radius) for place in places], axis=0)) for pose in drive(0.3, 2.0)
    ]
    assert not detect(scans)


@pytest.mark.parametrize("speed", [0.15, 0.5])
def test_opaque_walls_and_pillars_are_not_glass(speed: float) -> None:
    for start, end in ((-0.3, 3.0), (0.4, 0.7), (0.2, 0.9)):
        scans = [(pose, wall(pose, 1.0, glass=False, start=start, end=end)) for pose in drive(speed, 1.6)]
        assert not detect(scans)


@pytest.mark.parametrize("walk", [-1.0, -0.3, 0.0, 0.7, 1.2])
def test_people_who_pass_are_not_glass(walk: float) -> None:
    """All but those who keep abreast of the robot, whose marks a beam at a right angle clears."""
    scans = [
        (pose, post(pose, 1.2, 0.5 + walk * PERIOD * step, 0.15)) for step, pose in enumerate(drive(0.3, 1.5))
    ]
    assert not detect(scans)


@pytest.mark.parametrize("x", [0.8, 2.0, 3.5])
@pytest.mark.parametrize("walk", [0.2, 0.8, -1.2])
def test_people_who_pass_a_robot_that_stands_are_not_glass(x: float, walk: float) -> None:
    pose = SE2(0.0, 0.0, math.pi / 2.0)
    steps = range(round(1.6 / abs(walk) / PERIOD))
    assert not detect(
        [(pose, post(pose, x, walk * PERIOD * step - 0.8 * np.sign(walk), 0.15)) for step in steps]
    )


def costmap(robot: str = "chefbot_lidar") -> LayeredCostmap:
    given = LayerSettings(LOCAL_COSTMAP, load_robot(robot))
    layers = [load_plugin(name, object, given, CostmapLayer) for name in LOCAL_COSTMAP.layers]
    assert any(isinstance(layer, GlassLayer) for layer in layers)
    return LayeredCostmap(LOCAL_COSTMAP, disc(0.15), rolling=True, layers=layers)


def show(costs: LayeredCostmap, scans: list[tuple[SE2, Floats]], start: int = 0) -> None:
    """Pass scans without noise to a costmap, of a room with walls at x = -FAR and FAR."""
    for step, (pose, ranges) in enumerate(scans):
        costs.process(scan_of(pose, ranges, start + step), pose)


def test_a_costmap_keeps_glass_that_beams_pass() -> None:
    costs = costmap()
    show(costs, [(pose, wall(pose, 0.8, glass=True, end=1.3)) for pose in drive(0.3, 1.0)])
    here = SE2(0.0, 1.6, math.pi / 2.0)  # past the end of the glass: all beams pass what was measured
    show(costs, [(here, wall(here, 0.8, glass=True, end=1.3))] * 20, start=100)
    along = [costs.update().at(0.81, y) == LETHAL for y in np.arange(0.05, 0.9, 0.05)]
    assert all(along)
    assert LETHAL not in costs.source_cells(LASER)  # which is why the layer of the laser is not enough


def test_glass_that_has_left_is_cleared_at_a_right_angle() -> None:
    costs = costmap()
    show(costs, [(pose, wall(pose, 0.8, glass=True)) for pose in drive(0.3, 1.0)])
    assert costs.update().at(0.81, 0.5) == LETHAL
    poses = [SE2(0.0, pose.y - 0.2, pose.yaw) for pose in drive(0.1, 1.5)]
    show(costs, [(pose, wall(pose, FAR, glass=False)) for pose in poses], start=100)
    assert LETHAL not in costs.source_cells(GLASS)
    assert costs.update().at(0.81, 0.5) != LETHAL


def test_a_robot_without_lidar_finds_no_glass() -> None:
    costs = costmap("chefbot")
    show(costs, [(pose, wall(pose, 0.8, glass=True)) for pose in drive(0.3, 1.0)])
    assert not costs.has_source(GLASS)


def test_a_mapper_gets_no_beams_of_glass() -> None:
    detector = GlassDetector()
    for step, pose in enumerate(drive(0.3, 1.0)):
        scan = scan_of(pose, wall(pose, 0.8, glass=True), step)
        rest = detector.without_glass(pose, scan)
    glass = scan.ranges < 0.9
    assert glass.any() and np.isnan(rest.ranges[glass]).all()
    assert np.array_equal(rest.ranges[~glass], scan.ranges[~glass])


def test_a_mapper_gets_all_beams_of_posts() -> None:
    detector = GlassDetector()
    for step, pose in enumerate(drive(0.3, 1.0)):
        scan = scan_of(pose, post(pose, 0.8, 0.5, 0.1), step)
        assert detector.without_glass(pose, scan) is scan


@pytest.mark.parametrize("beams", [0, 1, 2])
def test_a_scan_with_hardly_a_beam_clears_nothing(beams: int) -> None:
    costs = costmap()
    show(costs, [(pose, wall(pose, 0.8, glass=True)) for pose in drive(0.3, 1.0)])
    marked = int((costs.source_cells(GLASS) == LETHAL).sum())
    scan = scan_of(SE2(0.0, 0.5, 0.0), np.full(len(ANGLES), math.inf), 100)
    for increment in (0.0, 0.1):
        few = msgspec.structs.replace(scan, angle_increment=increment, ranges=scan.ranges[:beams])
        costs.process(few, SE2(0.0, 0.5, 0.0))
    assert int((costs.source_cells(GLASS) == LETHAL).sum()) == marked > 0


def test_a_lidar_that_turns_clockwise_finds_and_clears_glass() -> None:
    costs = costmap()

    def reversed_scan(pose: SE2, ranges: Floats, step: int) -> LaserScan:
        scan = scan_of(pose, ranges, step)
        turned = {"angle_min": float(scan.angles[-1]), "angle_max": float(scan.angles[0])}
        turned |= {"angle_increment": -scan.angle_increment, "ranges": scan.ranges[::-1].copy()}
        return msgspec.structs.replace(scan, **turned)

    for step, pose in enumerate(drive(0.3, 1.0)):
        costs.process(reversed_scan(pose, wall(pose, 0.8, glass=True), step), pose)
    assert costs.update().at(0.81, 0.5) == LETHAL
    for step, pose in enumerate(drive(0.1, 1.5)):
        before = SE2(0.0, pose.y - 0.2, pose.yaw)
        costs.process(reversed_scan(before, np.full(len(ANGLES), math.inf), 100 + step), before)
    assert LETHAL not in costs.source_cells(GLASS)
