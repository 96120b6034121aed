"""Obstacles of any height in depth images rendered from boxes on a floor."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.errors import ScanError
from chefbot.robot.section import Mount
from chefbot.scan.camera import CameraModel
from chefbot.scan.drop_offs import FloorLimits
from chefbot.scan.obstacle_scan import ObstaclePoints, ObstacleScanner, ObstacleScanParams

HEIGHT = 0.3
TOP = 0.63
FLOOR = FloorLimits(steepest=0.105, front=0.08, noise=0.0018)
CAMERA = CameraModel(320, 240, 288.6, 288.6, 159.5, 119.5, 0.45, 8.0)
Box = tuple[float, float, float, float, float, float]
"""x1, x2, y1, y2, z1, z2 in the frame at the camera's foot."""


def render(boxes: list[Box], pitch: float = 0.0, camera: CameraModel = CAMERA) -> NDArray[np.float32]:
    """Exact depth of a floor and boxes seen from HEIGHT; NaN where there is nothing (slab method per box)."""
    right = (np.arange(camera.width) - camera.cx) / camera.fx
    down = (np.arange(camera.height) - camera.cy) / camera.fy
    c, s = math.cos(pitch), math.sin(pitch)
    shape = (camera.height, camera.width)
    ray = np.stack(
        [
            np.broadcast_to(a, shape)
            for a in ((c - s * down)[:, None], -right[None, :], (-s - c * down)[:, None])
        ]
    )
    eye = np.array([0.0, 0.0, HEIGHT])
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(ray[2] < 0, -HEIGHT / ray[2], np.inf)
        for box in boxes:
            near, far = np.zeros(shape), np.full(shape, np.inf)
            for axis in range(3):
                a, b = [(box[2 * axis + i] - eye[axis]) / ray[axis] for i in (0, 1)]
                near, far = np.maximum(near, np.fmin(a, b)), np.minimum(far, np.fmax(a, b))
            z = np.where((near < far) & (near > 0), np.minimum(z, near), z)
    return np.where(np.isfinite(z), z, np.nan).astype(np.float32)


def scanner(pitch: float = 0.0) -> ObstacleScanner:
    return ObstacleScanner(CAMERA, Mount(x=0.0, z=HEIGHT, pitch=pitch), TOP, FLOOR, ObstacleScanParams())


def look(boxes: list[Box], mounted: float = 0.0, nod: float = 0.0) -> tuple[ObstacleScanner, ObstaclePoints]:
    eye = scanner(mounted)
    return eye, eye.scan(render(boxes, mounted + nod))


def ahead(eye: ObstacleScanner, values: NDArray[np.float32], within: float = 0.1) -> NDArray[np.float32]:
    inner: NDArray[np.float32] = values[np.abs(eye.angles) < within]
    return inner


def first_floor(pitch: float = 0.0) -> float:
    """Where the lowest row meets the floor straight ahead."""
    down = (CAMERA.height - 1 - CAMERA.cy) / CAMERA.fy
    return HEIGHT / math.tan(math.atan(down) + pitch)


@pytest.mark.parametrize("mounted", [0.0, 0.2])
@pytest.mark.parametrize("nod", [-0.0174, 0.0, 0.0174])
def test_bare_floor_has_no_obstacle_while_the_camera_pitches(mounted: float, nod: float) -> None:
    eye, scan = look([], mounted, nod)
    inner = 0.4  # farther out a camera that looks down shows near floor only
    assert np.isinf(scan.obstacles).all()
    assert np.all(scan.clear_from < 1.2)
    assert np.all(ahead(eye, scan.clear_to, inner) > 3.0)


@pytest.mark.parametrize("mounted", [0.0, 0.2])
def test_the_blind_zone_is_not_cleared(mounted: float) -> None:
    eye, scan = look([], mounted)
    assert ahead(eye, scan.clear_from) == pytest.approx(first_floor(mounted), rel=0.02)


@pytest.mark.parametrize(
    ("name", "box", "distance"),
    [
        ("low box", (1.0, 1.3, -0.4, 0.4, 0.0, 0.08), 1.0),
        ("table top at the robot's height", (1.5, 2.3, -0.6, 0.6, 0.5, 0.54), 1.5),
        ("seat below the camera", (1.2, 1.6, -0.4, 0.4, 0.2, 0.24), 1.2),
        ("wall", (2.0, 2.1, -3.0, 3.0, 0.0, 2.0), 2.0),
    ],
)
@pytest.mark.parametrize("mounted", [0.0, 0.1])
def test_obstacles_of_any_height_count(name: str, box: Box, distance: float, mounted: float) -> None:
    eye, scan = look([box], mounted)
    straight = ahead(eye, scan.obstacles * np.cos(eye.angles).astype(np.float32))
    assert straight == pytest.approx(distance, abs=0.03)
    assert np.all(ahead(eye, scan.clear_to) <= ahead(eye, scan.obstacles))


@pytest.mark.parametrize(
    ("name", "box", "bottom", "top"),
    [
        ("table top", (1.5, 2.3, -0.6, 0.6, 0.5, 0.54), 0.5, 0.54),
        ("low box", (1.0, 1.3, -0.4, 0.4, 0.0, 0.08), 0.05, 0.08),
        ("wall", (1.5, 1.6, -3.0, 3.0, 0.0, 2.0), 0.06, TOP),
        ("seat before a wall", (1.2, 1.6, -0.4, 0.4, 0.2, 0.24), 0.2, 0.24),
    ],
)
def test_an_obstacle_has_its_minimum_and_maximum_height(
    name: str, box: Box, bottom: float, top: float
) -> None:
    eye, scan = look([box, (2.0, 2.1, -3.0, 3.0, 0.0, 2.0)])
    assert ahead(eye, scan.bottom) == pytest.approx(bottom, abs=0.02)
    assert ahead(eye, scan.top) == pytest.approx(top, abs=0.03)


def test_empty_bins_have_no_height() -> None:
    _, scan = look([])
    assert (scan.bottom > scan.top).all()


def test_a_leg_under_a_table_top_extends_down() -> None:
    top, leg = (1.5, 2.3, -0.6, 0.6, 0.5, 0.54), (1.52, 1.56, -0.05, 0.05, 0.0, 0.5)
    eye, scan = look([top, leg])
    at_leg = np.abs(np.tan(eye.angles) * 1.52) < 0.04
    beside = (np.abs(np.tan(eye.angles) * 1.52) > 0.1) & (np.abs(eye.angles) < 0.3)
    assert (scan.bottom[at_leg] < 0.1).all() and (scan.bottom[beside] > 0.45).all()


def test_an_edge_of_few_pixels_has_the_height_of_its_neighbour() -> None:
    eye = scanner()
    image = render([(1.0, 1.1, -0.1, 0.1, 0.0, 0.6)])
    whole = eye.scan(image)
    edge = np.flatnonzero(np.isfinite(whole.obstacles))[0]
    shown = (eye._bins == edge) & (image < 1.2)
    rows = np.flatnonzero(shown.any(axis=1))
    image[shown & (np.arange(240)[:, None] != rows[0]) & (np.arange(240)[:, None] != rows[0] + 1)] = np.nan
    scan = eye.scan(image)
    assert np.isfinite(scan.obstacles[edge])
    assert scan.bottom[edge] == pytest.approx(whole.bottom[edge], abs=0.02)
    assert scan.top[edge] == pytest.approx(whole.top[edge], abs=0.02)


def test_a_few_scattered_pixels_have_unknown_height() -> None:
    eye = scanner()
    image = np.full((240, 320), np.nan, np.float32)
    image[150:180:10, 160] = 0.46
    scan = eye.scan(image)
    at = np.flatnonzero(np.isfinite(scan.obstacles))
    assert len(at) == 1
    assert (scan.bottom[at], scan.top[at]) == (0.0, pytest.approx(TOP))


@given(st.integers(0, 2**31), st.floats(0.1, 0.5), st.floats(0.05, 0.1), st.floats(0.8, 3.0))
@settings(max_examples=25, deadline=None)
def test_a_flat_object_stays_flat_in_a_noisy_image(
    seed: int, low: float, thick: float, metres: float
) -> None:
    rng = np.random.default_rng(seed)
    exact = render([(metres, metres + 0.5, -0.6, 0.6, low, low + thick)])
    image = exact + rng.normal(0.0, 0.002, exact.shape).astype(np.float32) * exact**2
    image[rng.random(exact.shape) < 0.1] = np.nan
    eye = scanner()
    scan = eye.scan(image)
    seen = np.isfinite(ahead(eye, scan.obstacles))
    slack = 0.02 * metres + 0.02
    assert (ahead(eye, scan.bottom)[seen] > low - slack).mean() > 0.9
    assert (ahead(eye, scan.top)[seen] < low + thick + slack).mean() > 0.9


def test_objects_above_the_robot_do_not_count() -> None:
    _, scan = look([(1.5, 2.3, -0.6, 0.6, 0.72, 0.75)])
    assert np.isinf(scan.obstacles).all()


def test_the_low_box_is_missed_by_a_middle_row_scan() -> None:
    low: Box = (1.0, 1.3, -0.4, 0.4, 0.0, 0.08)
    assert not np.any(render([low])[119] < 2.0)
    eye, scan = look([low])
    assert ahead(eye, scan.obstacles).max() < 1.1


def test_an_obstacle_stays_in_its_sector() -> None:
    eye, scan = look([(1.5, 1.8, 0.2, 0.4, 0.0, 0.5)])
    seen = eye.angles[np.isfinite(scan.obstacles)]
    assert seen.min() == pytest.approx(math.atan2(0.2, 1.8), abs=0.02)
    assert seen.max() == pytest.approx(math.atan2(0.4, 1.5), abs=0.02)


def test_floor_behind_an_obstacle_is_not_cleared() -> None:
    eye, scan = look([(1.5, 1.6, -1.0, 1.0, 0.0, 0.1)])
    assert np.all(ahead(eye, scan.clear_to) <= ahead(eye, scan.obstacles))
    assert np.all(ahead(eye, scan.clear_to) > 1.3)


def test_a_hole_in_the_floor_ends_the_clear_interval() -> None:
    image = render([])
    distance = HEIGHT * CAMERA.fy / np.maximum(np.arange(240) - CAMERA.cy, 0.1)
    image[(distance > 1.2) & (distance < 2.2)] = np.nan
    eye = scanner()
    assert np.all(ahead(eye, eye.scan(image).clear_to) < 1.4)


def test_an_empty_image_clears_and_marks_nothing() -> None:
    scan = scanner().scan(np.zeros((240, 320), np.uint16))
    assert np.isinf(scan.obstacles).all() and np.isinf(scan.clear_from).all() and not scan.clear_to.any()
    assert (scan.bottom > scan.top).all()


def test_a_single_pixel_is_not_an_obstacle_and_two_are() -> None:
    image = render([])
    image[100, 160] = 1.0
    alone = scanner().scan(image)
    assert np.isinf(alone.obstacles).all() and (alone.bottom > alone.top).all()
    image[101, 160] = 1.0
    assert np.isfinite(scanner().scan(image).obstacles).sum() == 1


def test_millimetres_and_metres_agree() -> None:
    metres = render([(1.5, 1.8, 0.2, 0.4, 0.0, 0.5)])
    millimetres = np.nan_to_num(np.rint(metres * 1000), nan=0.0).clip(0, 65535).astype(np.uint16)
    one, other = scanner().scan(metres), scanner().scan(millimetres)
    np.testing.assert_array_equal(np.isfinite(one.obstacles), np.isfinite(other.obstacles))
    finite = np.isfinite(one.obstacles)
    np.testing.assert_allclose(one.obstacles[finite], other.obstacles[finite], atol=0.002)


def test_input_errors_name_the_fault() -> None:
    with pytest.raises(ScanError, match="max_height"):
        ObstacleScanner(CAMERA, Mount(x=0.0, z=0.3), 0.02, FLOOR, ObstacleScanParams())
    with pytest.raises(ScanError, match="looks back"):
        ObstacleScanner(CAMERA, Mount(x=0.0, z=0.3, pitch=1.5), TOP, FLOOR, ObstacleScanParams())
    with pytest.raises(ScanError, match="shape"):
        scanner().scan(np.zeros((2, 2), np.uint16))
