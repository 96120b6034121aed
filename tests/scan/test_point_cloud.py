"""Tests of point clouds from depth images: each point lies on the ray of its pixel at its depth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.errors import ScanError
from chefbot.msgs.sensor_msgs import PointCloud2
from chefbot.msgs.std_msgs import Header
from chefbot.scan.camera import CameraModel
from chefbot.scan.point_cloud import PointCloudConverter, point_cloud_message

MODEL = CameraModel(64, 48, 50.0, 55.0, 30.0, 22.0, 0.3, 5.0)


def points_of(message: PointCloud2) -> np.ndarray:
    """Return the points as a reader of the message finds them, by its layout."""
    offsets = {field.name: field.offset for field in message.fields}
    kind = np.dtype(
        {
            "names": list(offsets),
            "formats": ["<f4"] * 3,
            "offsets": list(offsets.values()),
            "itemsize": message.point_step,
        }
    )
    cloud = np.frombuffer(message.data.tobytes(), kind).reshape(message.height, message.width)
    return np.stack([cloud[name] for name in "xyz"], axis=-1)


@given(seed=st.integers(0, 2**32 - 1), step=st.integers(1, 9), metres=st.booleans())
def test_every_point_is_seen_at_its_pixel(seed: int, step: int, metres: bool) -> None:
    depth = np.random.default_rng(seed).integers(0, 6000, (48, 64)).astype(np.uint16)
    image = (depth / np.float32(1000.0)).astype(np.float32) if metres else depth
    cloud = points_of(point_cloud_message(Header(), PointCloudConverter(MODEL, step).points(image)))
    chosen = depth[::step, ::step]
    valid = (chosen >= 300) & (chosen <= 5000)
    assert cloud.shape[:2] == chosen.shape and np.array_equal(np.isfinite(cloud[..., 2]), valid)
    assert np.array_equal(np.isnan(cloud).any(axis=-1), ~valid)
    x, y, z = np.moveaxis(cloud[valid].astype(float), -1, 0)
    rows, columns = np.nonzero(valid)
    assert z == pytest.approx(chosen[valid] / 1000.0, rel=1e-6)
    assert 50.0 * x / z + 30.0 == pytest.approx(step * columns, abs=1e-3)
    assert 55.0 * y / z + 22.0 == pytest.approx(step * rows, abs=1e-3)


def test_a_pixel_without_a_reading_gives_no_point() -> None:
    depth = np.full((48, 64), 2.0, np.float32)
    depth[0, 0], depth[0, 1], depth[0, 2] = np.nan, np.inf, -1.0
    cloud = PointCloudConverter(MODEL, 1).points(depth)
    assert np.isnan(cloud[0, :3]).all() and np.isfinite(cloud[1:]).all()


@pytest.mark.parametrize("image", [np.zeros((64, 48), np.uint16), np.zeros((48, 64), np.float64)])
def test_another_image_is_refused(image: np.ndarray) -> None:
    with pytest.raises(ScanError, match="depth image of"):
        PointCloudConverter(MODEL, 1).points(image)
