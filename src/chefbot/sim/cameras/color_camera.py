"""The colour camera of a simulated robot."""

from __future__ import annotations

from functools import partial

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.sensor_msgs import CameraInfo
from chefbot.msgs.std_msgs import Header
from chefbot.robot.sensors import ColorCamera
from chefbot.scan.camera import color_camera_info
from chefbot.sim.cameras.picture_renderer import PictureRenderer, RenderWorker
from chefbot.sim.simulation import Simulation


class SimulatedColorCamera:
    """Renders pictures of a simulation in a thread, as an ideal lens with the robot file's field of view shows it."""

    def __init__(self, camera: ColorCamera, simulation: Simulation) -> None:
        self._camera, self._simulation = msgspec.structs.replace(camera, lens=None), simulation
        self._renderer = PictureRenderer(camera)
        self._worker: RenderWorker[NDArray[np.uint8]] = RenderWorker("color_camera")

    def start(self) -> None:
        """Start rendering what the camera sees now."""
        self._worker.start(partial(self._renderer.picture, self._simulation.color_capture()))

    def result(self) -> NDArray[np.uint8]:
        """Return the oldest picture that was started, (h, w, 3)."""
        return self._worker.result()

    def camera_info(self, header: Header) -> CameraInfo:
        """Return the intrinsics of the pictures, which are not those of a calibrated lens."""
        return color_camera_info(self._camera, header)

    def close(self) -> None:
        """Stop the thread that renders."""
        self._worker.close()
