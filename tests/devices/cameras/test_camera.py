"""What all depth cameras have in common: which one is opened, in which mode, and the unit of depth."""

from __future__ import annotations

import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.devices.cameras.camera import (
    CameraError,
    StreamMode,
    StreamRequest,
    best_mode,
    monotonic_ns,
    opener_of,
    selected,
    to_millimetres,
)
from chefbot.errors import UserError
from chefbot.robot.sensors import AUTO, DEPTH_CAMERA_DRIVERS

REQUEST = StreamRequest(AUTO, 320, 240, 15.0)
D435 = [StreamMode(w, h, f) for w, h in ((424, 240), (480, 270), (640, 480), (848, 480)) for f in (6, 15, 30)]


@pytest.mark.parametrize(
    ("found", "serial", "reason"),
    [
        ([], AUTO, "no RealSense camera is connected"),
        (
            ["1", "2"],
            AUTO,
            "several RealSense cameras are connected (1, 2): give sensors.depth_camera.serial",
        ),
        (["1", "2"], "3", "no RealSense camera with serial number 3 is connected; connected: 1, 2"),
        ([], "3", "no RealSense camera with serial number 3 is connected"),
    ],
)
def test_the_camera_is_not_clear(found: list[str], serial: str, reason: str) -> None:
    with pytest.raises(CameraError) as error:
        selected(found, serial, "RealSense")
    assert str(error.value) == reason


@pytest.mark.parametrize(("found", "serial"), [(["1"], AUTO), (["2", "1"], "1")])
def test_the_only_camera_or_the_named_one_is_opened(found: list[str], serial: str) -> None:
    assert selected(found, serial, "OAK") == "1"


def test_the_smallest_sufficient_mode_is_chosen() -> None:
    assert D435[best_mode(D435, REQUEST)] == StreamMode(424, 240, 15)
    assert D435[best_mode(D435, StreamRequest(AUTO, 640, 480, 20.0))] == StreamMode(640, 480, 30)
    with pytest.raises(CameraError, match="offers no depth images"):
        best_mode([], REQUEST)


sizes = st.integers(64, 2000)
modes = st.lists(st.builds(StreamMode, sizes, sizes, st.integers(5, 90)), min_size=1)


@given(modes, st.builds(StreamRequest, st.just(AUTO), sizes, sizes, st.floats(1.0, 60.0)))
def test_a_sufficient_mode_is_taken_if_there_is_one(
    offered: list[StreamMode], request: StreamRequest
) -> None:
    def is_enough(mode: StreamMode) -> bool:
        return mode.rate >= request.rate and mode.width * mode.height >= request.width * request.height

    best = offered[best_mode(offered, request)]
    enough = [mode for mode in offered if is_enough(mode)]
    if enough:
        assert is_enough(best)
        assert best.width * best.height == min(mode.width * mode.height for mode in enough)


@given(st.floats(1e-5, 0.1), st.integers(0, 65535))
def test_depth_is_in_millimetres_or_no_reading(unit: float, raw: int) -> None:
    depth = int(to_millimetres(np.full((1, 1), raw, np.uint16), unit)[0, 0])
    exact = raw * unit / 1e-3
    if exact > 65536:
        assert depth == 0
    else:
        assert depth == 0 or abs(depth - exact) <= 0.51 + 1e-6 * exact


def test_the_image_of_a_camera_is_not_part_of_its_memory() -> None:
    memory = np.full((2, 3), 1000, np.uint16)
    image = to_millimetres(memory, 1e-3)
    memory[:] = 0
    assert (image == 1000).all()


def test_a_time_stamp_that_cannot_be_right_means_now() -> None:
    now_ns, wall = time.monotonic_ns(), time.time_ns()
    assert abs(now_ns - 50_000_000 - monotonic_ns(wall - 50_000_000)) < 40_000_000
    for stamp_ns in (0, wall + 10_000_000_000, wall - 60_000_000_000):
        assert monotonic_ns(stamp_ns) >= now_ns


@pytest.mark.parametrize("driver", DEPTH_CAMERA_DRIVERS)
def test_a_missing_sdk_is_named_with_its_pip_command(driver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("pyrealsense2", "depthai", "pyorbbecsdk"):
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, f"chefbot.devices.cameras.{driver}", raising=False)
    with pytest.raises(UserError, match=rf"pip install 'chefbot\[{driver}\]'"):
        opener_of(driver)
