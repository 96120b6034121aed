"""Depth image to scan: the peer's vectors, our own copies of them, and geometry."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.errors import ScanError
from chefbot.robot.load import load_robot
from chefbot.scan.camera import CameraModel, depth_image
from chefbot.scan.depth_to_scan import DepthToScan, DepthToScanParams

SHARED = Path(os.environ.get("CHEFBOT_SHARED", Path(__file__).parents[2].parent / "shared"))
CAMERA = CameraModel(640, 480, 570.3422241210938, 570.3422241210938, 314.5, 235.5, 0.45, 10.0)


def converter(scan_height: int = 1, camera: CameraModel = CAMERA) -> DepthToScan:
    return DepthToScan(camera, DepthToScanParams(scan_height=scan_height))


def low_on_diagonals(convert: DepthToScan, scan_height: int, low: int, high: int) -> np.ndarray:
    image = np.full((480, 640), high, np.uint16)
    first, end = convert.scan_rows
    for row in range(first, end):
        image[row, np.arange(640) % scan_height == row % scan_height] = low
    return image


@pytest.mark.data
def test_conversion_equals_the_reference_vectors() -> None:
    path = SHARED / "data/depth/vectors.json"
    if not path.exists():
        pytest.skip(f"{path} is absent: set CHEFBOT_SHARED to the folder of shared data")
    vectors = json.loads(path.read_text())["depthimage"]
    intrinsics = {k: vectors["camera"][k] for k in ("fx", "fy", "cx", "cy")}
    limits = {k: vectors["settings"][k] for k in ("range_min", "range_max")}
    camera = CameraModel(
        width=vectors["image"]["width"], height=vectors["image"]["height"], **intrinsics, **limits
    )
    assert len(vectors["cases"]) == 7
    for case in vectors["cases"]:
        check_case(case, camera, vectors["settings"]["scan_height"])


def check_case(case: dict[str, Any], camera: CameraModel, scan_height: int) -> None:
    if "accepted" in case:
        for encoding in case["accepted"]:
            depth_image(bytes(16), encoding, 2, 2, 8)
        for encoding in case["rejected"]:
            with pytest.raises(ScanError, match=encoding):
                depth_image(bytes(16), encoding, 2, 2, 8)
        return
    expect = case["expect"]
    if "low_mm" in case:
        for height in range(case["scan_height"]["from"], case["scan_height"]["to"] + 1):
            convert = converter(height, camera)
            ranges = convert.convert(low_on_diagonals(convert, height, case["low_mm"], case["high_mm"]))
            within = ranges[(ranges >= camera.range_min) & (ranges <= camera.range_max)]
            assert within.size and within.max() < expect["every_range_within_limits_below_m"]
        return
    ranges = converter(scan_height, camera).convert(image_of(case, camera))
    finite = ranges[np.isfinite(ranges)]
    assert ranges.size == expect.get("beams", 640)
    assert finite.size == expect.get("finite_ranges", finite.size)
    low, high = expect.get("finite_ranges_within", (camera.range_min, camera.range_max))
    assert np.all((finite >= low) & (finite <= high))
    assert (ranges < 0).sum() <= expect.get("negative_ranges", 640)
    assert (ranges > 0).sum() <= expect.get("positive_ranges", 640)
    assert np.isnan(ranges).mean() <= expect.get("nan_at_most_share", 1.0)


def image_of(case: dict[str, Any], camera: CameraModel) -> Any:
    shape = (camera.height, camera.width)
    if "fill_mm" in case:
        return np.full(shape, case["fill_mm"], np.uint16)
    if "fill" in case:
        return np.full(shape, float(case["fill"]), np.float32)
    low, high = case["uniform_mm"]
    return np.random.default_rng(5).integers(low, high, shape).astype(np.uint16)


@pytest.mark.parametrize("kind", ["mm", "m"])
@pytest.mark.parametrize("scan_height", [1, 10, 100])
def test_a_flat_wall_is_straight_in_every_bin(kind: str, scan_height: int) -> None:
    convert = converter(scan_height)
    wall = np.full((480, 640), 3855, np.uint16) if kind == "mm" else np.full((480, 640), 3.855, np.float32)
    ranges = convert.convert(wall)
    assert ranges.dtype == np.float32 and np.isfinite(ranges).all()
    # a bin's angle is off its column's by less than one column: the wall bends by less than a pixel's worth
    assert np.abs(ranges * np.cos(convert.angles) - 3.855).max() < 3.855 * np.tan(0.51) / 570


def test_the_scan_runs_from_right_to_left() -> None:
    convert = converter()
    image = np.full((480, 640), 5000, np.uint16)
    image[:, 600:] = 1000  # right in the image is right of the robot, a negative angle
    ranges = convert.convert(image)
    assert convert.angle_min < 0 < convert.angle_max
    assert ranges[0] < 1.2 and ranges[-1] > 5.0
    np.testing.assert_allclose(np.diff(convert.angles), convert.angle_increment)


@pytest.mark.parametrize("scan_height", [1, 7, 99])
def test_each_bin_is_the_nearest_depth_within_the_row_band(scan_height: int) -> None:
    convert = converter(scan_height)
    image = np.full((480, 640), 1000, np.uint16)
    first, end = convert.scan_rows
    assert first == int(235.5 - scan_height / 2) and end - first == scan_height
    image[first:end] = 4000
    assert np.nanmin(convert.convert(image)) >= 4.0
    image[end - 1] = 2000
    assert np.nanmax(convert.convert(image)) < 2.4


@settings(max_examples=40)
@given(
    st.sampled_from([0, 1, 300, 449, 450, 451, 2000, 9999, 10000, 10001, 65535]),
    st.sampled_from([0, 440, 600, 5000, 12000]),
)
def test_millimetres_and_metres_agree_at_the_limits(one: int, other: int) -> None:
    convert = converter(2)
    image = np.full((480, 640), one, np.uint16)
    image[convert.scan_rows[0]] = other
    metres = np.where(image == 0, np.nan, image * 0.001).astype(np.float32)
    np.testing.assert_allclose(convert.convert(image), convert.convert(metres), rtol=1e-5)
    finite = convert.convert(image)[np.isfinite(convert.convert(image))]
    assert np.all((finite >= 0.45 - 1e-5) & (finite <= 10.0 + 1e-4))


@pytest.mark.parametrize("fill", [np.nan, np.inf, -np.inf])
def test_missing_depth_stays_missing(fill: float) -> None:
    ranges = converter(5).convert(np.full((480, 640), fill, np.float32))
    np.testing.assert_array_equal(ranges, np.full(640, fill, np.float32))


def test_depth_below_range_min_does_not_hide_what_is_behind() -> None:
    convert = converter(2)
    image = np.full((480, 640), 200, np.uint16)
    image[convert.scan_rows[0]] = 3000
    assert np.isfinite(convert.convert(image)).all()


def test_rows_with_padding_and_big_endian_pixels_are_read() -> None:
    pixels = np.array([[1, 2, 3], [4, 5, 60000]], np.uint16)
    padded = b"".join(row.tobytes() + b"xx" for row in pixels.astype(">u2"))
    np.testing.assert_array_equal(depth_image(padded, "16UC1", 2, 3, 8, is_bigendian=True), pixels)


def test_input_errors_name_the_fault() -> None:
    with pytest.raises(ScanError, match="scan_height 480"):
        converter(480)
    with pytest.raises(ScanError, match="shape"):
        converter().convert(np.zeros((10, 10), np.uint16))
    with pytest.raises(ScanError, match="float64"):
        converter().convert(np.zeros((480, 640)))  # type: ignore[arg-type]
    with pytest.raises(ScanError, match="too short"):
        depth_image(bytes(7), "16UC1", 2, 2, 4)


def test_the_robot_camera_covers_its_field_of_view() -> None:
    camera = load_robot("chefbot").sensors.depth_camera
    assert camera is not None
    convert = converter(camera=CameraModel.of(camera))
    pixel = 1.0 / camera.focal_length_px
    assert abs((convert.angle_max - convert.angle_min) - camera.field_of_view) < 2 * pixel
    assert convert.angle_min == pytest.approx(-convert.angle_max)
