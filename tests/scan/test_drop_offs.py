"""Drop-offs in depth images rendered from a floor with an edge, a ramp or a doorstep."""

from __future__ import annotations

import math
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.robot.load import load_robot
from chefbot.scan.camera import CameraModel
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams
from chefbot.scan.drop_offs import DROP_HEIGHT, PITCH_TOLERANCE, FloorLimits, drop_range
from chefbot.scan.obstacle_scan import ObstaclePoints, ObstacleScanner, ObstacleScanParams, without_floor_gaps

ROBOT = load_robot("chefbot")
assert ROBOT.sensors.depth_camera is not None
SPEC = ROBOT.sensors.depth_camera
CAMERA = CameraModel.of(SPEC)
SCANNER = ObstacleScanner(
    CAMERA, SPEC.mount, 0.63, FloorLimits.of(ROBOT, SPEC, PITCH_TOLERANCE), ObstacleScanParams()
)
AHEAD = np.abs(SCANNER.angles) < 0.3
Profile = tuple[tuple[float, float], ...]
"""Corners (distance, height) of the floor's profile ahead, m; level before the first, and after the last."""
NODS = (-PITCH_TOLERANCE, 0.0, PITCH_TOLERANCE)


def step(edge: float, depth: float) -> Profile:
    return ((edge, 0.0), (edge + 1e-4, -depth))


def render(
    profile: Profile, nod: float = 0.0, noise: float = SPEC.noise, seed: int = 1
) -> NDArray[np.float32]:
    """Return the measured depth of a floor that is as wide as the view; its profile holds along the optical axis."""
    camera = CAMERA
    down = (np.arange(camera.height) - camera.cy) / camera.fy
    forward, upward = math.cos(nod) - down * math.sin(nod), -math.sin(nod) - down * math.cos(nod)
    distance = np.full(camera.height, np.inf)
    corners = [(-100.0, profile[0][1]), *profile, (100.0, profile[-1][1])]
    for (x0, z0), (x1, z1) in pairwise(corners):
        # z + t u = z0 + (t f - x0) g on the segment
        gradient = (z1 - z0) / (x1 - x0)
        with np.errstate(divide="ignore"):
            t = (z0 - gradient * x0 - SPEC.mount.z) / (upward - gradient * forward)
        on = (t > 0.0) & (t * forward >= x0) & (t * forward <= x1)
        distance = np.where(on & (t < distance), t, distance)
    depth = np.repeat(distance[:, None], camera.width, axis=1)
    depth = np.where(np.isfinite(depth), depth, np.nan)
    depth += np.random.default_rng(seed).normal(0.0, noise, depth.shape) * depth**2
    depth[~((depth >= camera.range_min) & (depth <= camera.range_max))] = np.nan
    return depth.astype(np.float32)


def drops(scan: ObstaclePoints) -> NDArray[np.bool_]:
    return np.asarray(scan.bottom < 0.0)


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize("depth", [0.03, 0.05, 0.17, 1.0])
@pytest.mark.parametrize("edge", [0.8, 0.9])
def test_a_drop_off_is_an_obstacle_at_its_edge(depth: float, edge: float, nod: float) -> None:
    scan = SCANNER.scan(render(step(edge, depth), nod))
    along_axis = scan.obstacles * np.cos(SCANNER.angles)
    assert drops(scan)[AHEAD].all()
    assert along_axis[AHEAD] == pytest.approx(edge, abs=0.03)
    assert (scan.clear_to[AHEAD] <= scan.obstacles[AHEAD]).all() and (scan.top[AHEAD] == 0.0).all()


def test_every_drop_off_in_the_drop_range_is_seen() -> None:
    limit = drop_range(ROBOT)
    assert 1.0 < limit < SPEC.range_max
    for edge in np.arange(0.8, 0.9 * limit, 0.1).tolist():
        assert drops(SCANNER.scan(render(step(edge, DROP_HEIGHT))))[AHEAD].mean() > 0.5, edge


@pytest.mark.parametrize("edge", [0.2, 0.5])
def test_an_edge_in_the_blind_zone_leaves_no_free_floor(edge: float) -> None:
    scan = SCANNER.scan(render(step(edge, 0.17)))
    assert drops(scan)[AHEAD].all()
    assert not scan.clear_to[AHEAD].any() and np.isinf(scan.clear_from[AHEAD]).all()


@pytest.mark.parametrize("columns", [1, 2, 3, 4, 6, 12, 40])
def test_no_single_bin_shows_a_drop_off(columns: int) -> None:
    """Beside the edge of a door post floor that is farther away may look as if it were lower."""
    depth, hole = render(step(5.0, 0.17)), render(step(0.8, 0.17))
    first = CAMERA.width // 2
    depth[:, first : first + columns] = hole[:, first : first + columns]
    changes = np.flatnonzero(np.diff(np.concatenate([[0], drops(SCANNER.scan(depth)), [0]])))
    runs = changes[1::2] - changes[::2]
    assert (runs >= 2).all()
    assert len(runs) == 1 if columns >= 12 else len(runs) <= 1


def test_a_narrow_shaft_is_found_by_its_far_wall() -> None:
    shaft = ((1.0, 0.0), (1.0001, -0.5), (1.2, -0.5), (1.2001, 0.0))
    assert drops(SCANNER.scan(render(shaft)))[AHEAD].all()


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize("far", [0.9, 1.2, 1.6, 2.0])
@pytest.mark.parametrize("edge", [0.2, 0.4, 0.6])
def test_a_hole_with_floor_behind_it_is_seen_from_its_edge(edge: float, far: float, nod: float) -> None:
    """Its far side is a wall below the floor; the floor behind it carries the robot again."""
    scan = SCANNER.scan(render(((edge, 0.0), (edge + 1e-4, -0.85), (far, -0.85), (far + 1e-4, 0.0)), nod))
    assert drops(scan)[AHEAD].all()
    assert not scan.clear_to[AHEAD].any()


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize("far", [1.2, 1.6, 2.0])
@pytest.mark.parametrize("edge", [0.2, 0.5, 0.8])
def test_the_ground_is_lower_up_to_the_far_side(edge: float, far: float, nod: float) -> None:
    scan = SCANNER.scan(render(((edge, 0.0), (edge + 1e-4, -0.45), (far, -0.45), (far + 1e-4, 0.0)), nod))
    lower_to = scan.lower_to * np.cos(SCANNER.angles)
    assert lower_to[AHEAD] == pytest.approx(far, abs=0.08)


def test_stairs_are_lower_as_far_as_they_are_seen() -> None:
    stairs = ((1.0, 0.0), (1.0001, -0.17), (1.3, -0.17), (1.3001, -0.34), (1.6, -0.34), (1.6001, -0.51))
    assert (SCANNER.scan(render(stairs)).lower_to[AHEAD] > 1.5).all()


def test_level_floor_and_walls_are_not_lower() -> None:
    for profile in (((1.0, 0.0),), ((1.0, 0.0), (1.0001, 2.5))):
        assert not SCANNER.scan(render(profile)).lower_to.any()


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize("far", [1.0, 1.2, 1.6])
@pytest.mark.parametrize("edge", [0.2, 0.4, 0.6, 0.8])
def test_a_hole_that_ends_at_a_wall_is_seen(edge: float, far: float, nod: float) -> None:
    """Its far side and the wall are one surface, as of a stairwell."""
    scan = SCANNER.scan(render(((edge, 0.0), (edge + 1e-4, -0.6), (far, -0.6), (far + 1e-4, 2.5)), nod))
    assert drops(scan)[AHEAD].all()
    assert (scan.clear_to[AHEAD] <= edge + 0.05).all()


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize("at", [0.75, 1.0, 1.5, 3.0])
def test_a_wall_on_the_floor_is_not_a_drop_off(at: float, nod: float) -> None:
    for seed in range(5):
        assert not drops(SCANNER.scan(render(((at, 0.0), (at + 1e-4, 2.5)), nod, seed=seed))).any()


@pytest.mark.parametrize("nod", NODS)
@pytest.mark.parametrize(
    ("name", "profile"),
    [
        ("level floor", ((1.0, 0.0), (2.0, 0.0))),
        ("ramp down from the robot on", ((0.15, 0.0), (4.15, -4.0 * 0.08))),
        ("ramp down", ((1.2, 0.0), (4.2, -3.0 * 0.08))),
        ("doorstep", ((1.0, 0.0), (1.0001, 0.02), (1.1, 0.02), (1.1001, 0.0))),
        ("carpet", ((0.9, 0.0), (0.9001, 0.012), (1.6, 0.012), (1.6001, 0.0))),
        ("uneven tiles", ((0.9, 0.0), (0.9001, -0.005), (1.2, -0.005), (1.2001, 0.004), (1.5, 0.0))),
    ],
)
def test_floor_that_carries_the_robot_is_not_a_drop_off(name: str, profile: Profile, nod: float) -> None:
    for seed in range(5):
        assert not drops(SCANNER.scan(render(profile, nod, seed=seed))).any(), name


def test_noise_is_not_a_drop_off() -> None:
    found = [drops(SCANNER.scan(render(step(50.0, 0.0), seed=seed))).sum() for seed in range(100)]
    assert sum(found) == 0


def test_more_noise_shortens_the_drop_range() -> None:
    noisy = msgspec.structs.replace(SPEC, noise=3.0 * SPEC.noise)
    sensors = msgspec.structs.replace(ROBOT.sensors, depth_camera=noisy)
    assert drop_range(msgspec.structs.replace(ROBOT, sensors=sensors)) < drop_range(ROBOT)
    assert drop_range(load_robot("desk")) == 0.0


def test_a_flat_scan_over_a_drop_off_has_no_range() -> None:
    image = render(step(1.0, 0.17))
    image[:120] = 4.0  # the wall behind the stairs
    flat = DepthToScan(CAMERA, DepthToScanParams())
    points, ranges = SCANNER.scan(image), flat.convert(image)
    assert np.isfinite(ranges).all()
    kept = without_floor_gaps(ranges, flat.angles, points, SCANNER.angles)
    assert np.isnan(kept[np.abs(flat.angles) < 0.3]).all()
    image[:120] = 0.9  # something on this side of the edge
    points, ranges = SCANNER.scan(image), flat.convert(image)
    np.testing.assert_array_equal(without_floor_gaps(ranges, flat.angles, points, SCANNER.angles), ranges)
