"""The driver of Orbbec cameras: what needs no camera."""

from __future__ import annotations

import time

import numpy as np
import pytest

from chefbot.devices.cameras.camera import CameraError, Intrinsics, StreamRequest
from chefbot.robot.sensors import AUTO

ob = pytest.importorskip("pyorbbecsdk", reason="needs pip install 'chefbot[orbbec]'", exc_type=ImportError)


def test_an_image_has_its_depth_and_its_time() -> None:
    from chefbot.devices.cameras.orbbec import frame_of

    made = ob.Frame.create_video_frame(ob.OBFrameType.DEPTH_FRAME, ob.OBFormat.Y16, 4, 3, 8)
    frame = made.as_depth_frame()
    frame.update_data(np.arange(12, dtype=np.uint16).view(np.uint8))
    frame.set_value_scale(0.5)
    frame.set_system_timestamp_us(int(1e6 * (time.time() - 0.05)))
    image = frame_of(frame, Intrinsics(300.0, 301.0, 2.0, 1.0))
    assert image.depth.tolist() == [
        [0, 0, 1, 2],
        [2, 2, 3, 4],
        [4, 4, 5, 6],
    ]  # half a millimetre each, to even
    assert image.intrinsics.fy == 301.0
    assert time.monotonic_ns() - image.taken_ns >= 49_000_000


def test_no_camera_is_connected() -> None:
    from chefbot.devices.cameras.orbbec import open_orbbec

    ob.Context.set_logger_level(ob.OBLogLevel.NONE)
    if ob.Context().query_devices().get_count():
        pytest.skip("an Orbbec camera is connected")
    with pytest.raises(CameraError, match="no Orbbec camera is connected"):
        open_orbbec(StreamRequest(AUTO, 640, 480, 15.0))
