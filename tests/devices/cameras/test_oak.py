"""The driver of OAK cameras: what needs no camera."""

from __future__ import annotations

import time
from datetime import timedelta

import numpy as np
import pytest

from chefbot.devices.cameras.camera import CameraError, StreamMode, StreamRequest
from chefbot.robot.sensors import AUTO

dai = pytest.importorskip("depthai", reason="needs pip install 'chefbot[oak]'", exc_type=ImportError)


def test_an_image_has_its_depth_intrinsics_and_time() -> None:
    from chefbot.devices.cameras.oak import frame_of

    message = dai.ImgFrame()
    message.setType(dai.ImgFrame.Type.RAW16)
    message.setWidth(4)
    message.setHeight(3)
    message.setData(np.arange(12, dtype=np.uint16).view(np.uint8))
    taken = time.monotonic() - 0.05
    message.setTimestamp(timedelta(seconds=taken))
    transformation = dai.ImgTransformation(4, 3)
    transformation.setIntrinsicMatrix([[400.0, 0.0, 1.5], [0.0, 401.0, 1.0], [0.0, 0.0, 1.0]])
    message.setTransformation(transformation)
    frame = frame_of(message)
    assert frame.depth.tolist() == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    assert frame.intrinsics == pytest.approx((400.0, 401.0, 1.5, 1.0))
    assert frame.taken_ns / 1e9 == pytest.approx(taken, abs=1e-5)


@pytest.mark.parametrize(
    ("width", "rate", "mode"),
    [(320, 15.0, StreamMode(640, 400, 15.0)), (200, 60.0, StreamMode(320, 200, 30.0))],
)
def test_stereo_has_the_size_and_rate_of_the_robot_file(width: int, rate: float, mode: StreamMode) -> None:
    from chefbot.devices.cameras.oak import mode_for

    assert mode_for(StreamRequest(AUTO, width, width * 3 // 4, rate)) == mode


def test_no_camera_is_connected() -> None:
    from chefbot.devices.cameras.oak import open_oak

    if dai.Device.getAllAvailableDevices():
        pytest.skip("an OAK camera is connected")
    with pytest.raises(CameraError, match="no OAK camera is connected"):
        open_oak(StreamRequest(AUTO, 640, 400, 15.0))
