"""Tests that the layers of the web UI validate, copy, rate-limit and encode their data."""

from __future__ import annotations

import io
import json
import struct
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from PIL import Image

from chefbot.maths.grid import Grid
from chefbot.ui import protocol
from chefbot.ui.display.views import DepthView, RobotView, ScanView, StatusView
from chefbot.ui.hub import LayerStore
from chefbot.ui.image_encoding import colorize_depth, jpeg
from chefbot.ui.layers import LAYERS


def split(frame: protocol.Frame) -> tuple[dict[str, Any], bytes]:
    assert isinstance(frame, bytes)
    (size,) = struct.unpack_from("<H", frame)
    return json.loads(frame[2 : 2 + size]), frame[2 + size :]


@given(
    arrays.arrays(
        np.float64,
        st.tuples(st.integers(1, 20), st.just(3)),
        elements=st.floats(-1e6, 1e6, allow_subnormal=False),
    )
)
def test_points_never_wrap(rows: np.ndarray) -> None:
    header, body = split(protocol.points("particles", rows.copy()))
    sent = np.frombuffer(body, "<i2").reshape(-1, header["columns"]) * header["unit"]
    extent = float(np.abs(rows[:, :2] - rows[0, :2]).max())
    tolerance = max(0.5 * protocol.CENTIMETRE, 0.51 * extent / 32767) + 1e-6
    assert np.abs(sent[:, :2] + [header["x"], header["y"]] - rows[:, :2]).max() <= tolerance
    assert np.abs(np.exp(1j * sent[:, 2]) - np.exp(1j * rows[:, 2])).max() <= 1e-3


def test_a_grid_is_encoded_cell_by_cell() -> None:
    cells = np.arange(-1, 101, dtype=np.int8).repeat(5).reshape(17, 30)
    value = LAYERS["map"].validate(Grid(cells, 0.05, -1.0, 2.0))
    header, body = split(LAYERS["map"].encode("map", value))
    assert (header["width"], header["height"], header["kind"]) == (30, 17, "int8")
    assert (header["x"], header["y"], header["resolution"]) == (-1.0, 2.0, 0.05)
    assert zlib.decompress(body) == cells.tobytes()


def test_the_scan_is_transformed_to_the_frame_of_its_pose() -> None:
    scan = ScanView(
        (1.0, 2.0, np.pi / 2), np.array([0.0, np.pi / 2, 1.0]), np.array([2.0, 1.0, np.inf]), "laser"
    )
    points, frame = LAYERS["scan"].validate(scan)
    assert np.allclose(points, [[1.0, 4.0], [0.0, 2.0]])
    header, body = split(LAYERS["scan"].encode("scan", (points, frame)))
    assert header["frame"] == "laser"
    assert np.allclose(np.frombuffer(body, "<i2").reshape(-1, 2), [[0, 0], [-100, -200]])


@given(st.integers(1, 700), st.integers(1, 9), st.floats(0.1, 64.0))
def test_downsampled_depth_points_keep_their_directions(width: int, height: int, wall: float) -> None:
    depth = np.full((height, width), wall, np.float32)
    depth[0, 0] = np.nan
    focal, cx = 500.0, (width - 1) / 2
    header, body = split(
        LAYERS["depth"].encode("depth", LAYERS["depth"].validate(DepthView(depth, focal, cx, 0.0, "camera")))
    )
    metres = np.frombuffer(zlib.decompress(body), "<u2").reshape(header["height"], header["width"]) / 1000
    step = -(-width // 80)
    assert header["width"] <= 80
    assert metres[0, 0] == 0
    assert np.abs(metres.ravel()[1:] - wall).max(initial=0.0) <= 6e-4
    across = (np.arange(header["width"]) - header["cx"]) / header["focal"]
    assert np.allclose(across, (np.arange(0, width, step) - cx) / focal)


def test_non_finite_points_are_dropped_and_none_is_valid() -> None:
    assert len(LAYERS["path"].validate([[0, 0], [np.nan, 1], [1, np.inf], [2, 2]])) == 2
    header, body = split(LAYERS["path"].encode("path", LAYERS["path"].validate([])))
    assert (header["columns"], body) == (2, b"")


def test_a_layer_stores_a_copy() -> None:
    store, points = LayerStore(), np.zeros((2, 2))
    store.set_layer("path", points)
    points[:] = 7.0
    store.encode_due(lambda: 0.0)
    header, body = split(store.frames["path"])
    assert (header["x"], body) == (0.0, bytes(8))


@pytest.mark.parametrize(
    ("layer", "payload"),
    [
        ("pathh", [[0, 0]]),
        ("path", [1, 2, 3]),
        ("particles", np.zeros((3, 2))),
        ("goal", (0, np.nan, 0)),
        ("robot", {"x": 1}),
        ("map", Grid(np.zeros((2, 2), np.float32), 1.0, 0.0, 0.0)),
        ("camera", np.zeros((4, 4), np.uint8)),
        ("scan", np.zeros((3, 2))),
        ("depth", np.zeros((4, 4), np.float32)),
        ("frames", [{"name": "map"}]),
        ("description", b"<robot/>"),
        ("joints", {"wheel_left_joint": "fast"}),
    ],
)
def test_an_invalid_payload_raises_in_the_caller(layer: str, payload: Any) -> None:
    with pytest.raises((ValueError, TypeError)):
        LayerStore().set_layer(layer, payload)


def test_a_layer_is_rate_limited_and_sends_its_newest_value() -> None:
    store, now = LayerStore(), 0.0
    store.set_layer("status", StatusView(phase="old"))
    assert store.encode_due(lambda: now) == ["status"]
    for number in range(1000):
        store.set_layer("status", StatusView(phase=str(number)))
    now = 0.05
    assert store.encode_due(lambda: now) == []
    now = 0.11
    assert store.encode_due(lambda: now) == ["status"]
    assert json.loads(store.frames["status"])["value"]["phase"] == "999"
    now = 0.5
    assert store.encode_due(lambda: now) == []


def test_a_value_that_has_not_changed_is_not_sent_again() -> None:
    store, here = LayerStore(), RobotView(x=1.0, y=2.0, yaw=0.0)
    for now, view, expected in [
        (0.0, here, ["robot"]),
        (1.0, here, []),
        (2.0, None, ["robot"]),
        (3.0, None, []),
    ]:
        store.set_layer("robot", view)
        assert store.encode_due(lambda now=now: now) == expected


def test_a_layer_has_a_value_before_and_after_encoding() -> None:
    store = LayerStore()
    assert not store.has_value("labels")
    for value, expected in ({"table_1": "Window"}, True), (None, False), ({}, True):
        store.set_layer("labels", value)
        assert store.has_value("labels") is expected
        store.encode_due(lambda: 0.0)
        assert store.has_value("labels") is expected


def test_a_layer_that_is_slow_to_encode_is_sent_less_often() -> None:
    store, times = LayerStore(), iter([0.0, 0.0, 0.4])
    store.set_layer("path", np.zeros((2, 2)))
    store.encode_due(lambda: next(times))
    store.set_layer("path", np.ones((2, 2)))
    assert store.encode_due(lambda: 3.9) == []
    assert store.encode_due(lambda: 4.0) == ["path"]


def test_none_clears_a_layer_and_non_finite_numbers_become_null() -> None:
    store = LayerStore()
    store.set_layer("goal", None)
    store.set_layer("robot", RobotView(x=float("nan"), y=0.0, yaw=0.0))
    store.encode_due(lambda: 0.0)
    assert json.loads(store.frames["goal"]) == {"layer": "goal", "value": None}
    assert json.loads(store.frames["robot"])["value"]["x"] is None


def test_pictures_are_small_jpegs_with_distinct_depth_colours() -> None:
    picture = Image.open(io.BytesIO(jpeg(np.zeros((480, 640, 3), np.uint8))))
    assert (picture.format, picture.size) == ("JPEG", (320, 240))
    near, far, unknown, millimetres = colorize_depth(np.array([[0.5, 4.5, np.nan, 0.5]]))[0].astype(int)
    assert near[0] > near[2]
    assert far[2] > far[0]
    assert not unknown.any()
    assert (colorize_depth(np.array([[500]], np.uint16))[0, 0] == millimetres).all()
