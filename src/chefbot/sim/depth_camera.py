"""A depth camera without a graphics card: pictures by rays, with the faults of a real one."""

from __future__ import annotations

import math
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.random import default_rng
from numpy.typing import NDArray

from chefbot.robot.sensors import DepthCamera
from chefbot.sim.depth_raycast import draw
from chefbot.sim.realism import Profile
from chefbot.sim.shading import shade
from chefbot.sim.simulation import Capture

GRAZING = math.radians(80.0)
"""A surface seen more steeply across the image than this, or an edge that looks so, may give no depth."""
DROPOUT = 0.7
"""How often it then gives none."""


class Rendering(NamedTuple):
    """The exact view: depth (h, w) metres along the optical axis, inf for none; number (h, w) of solids."""

    depth: NDArray[np.float32]
    number: NDArray[np.int32]


class DepthFrame(NamedTuple):
    """serial: which frame. depth: (h, w) metres along the optical axis, NaN where the camera measured none.

    colour: (h, w, 3) the scene in colours, or None when it was not asked for.
    """

    serial: int
    depth: NDArray[np.float32]
    colour: NDArray[np.uint8] | None


class DepthRenderer:
    """One camera. Frame number and seed determine the noise, whatever the order in which frames are made."""

    def __init__(self, camera: DepthCamera, profile: Profile = "perfect", seed: int = 0) -> None:
        self._camera, self._profile, self._seed = camera, profile, seed

    def render(self, capture: Capture) -> Rendering:
        """The exact view."""
        size = self._camera.height, self._camera.width
        depth, number = np.empty(size, dtype=np.float32), np.empty(size, dtype=np.int32)
        kind, centre, half, yaw, _ = capture.shapes
        position, rotation = capture.position, np.ascontiguousarray(capture.rotation)
        draw(kind, centre, half, yaw, position, rotation, self._camera.focal_length_px, depth, number)
        return Rendering(depth, number)

    def measure(self, rendering: Rendering, index: int) -> NDArray[np.float32]:
        """What the camera makes of the view in frame `index`: (h, w) metres, NaN out of range or dropped."""
        camera, real = self._camera, self._profile != "perfect"
        rng = default_rng((self._seed, index))
        size = rendering.depth.shape if real else (0, 0)
        noise = rng.standard_normal(size, dtype=np.float32)
        luck = rng.random(size, dtype=np.float32)
        measured = np.empty_like(rendering.depth)
        jump = math.tan(GRAZING) / camera.focal_length_px
        limits = (camera.range_min, camera.range_max)
        spoil(rendering.depth, noise, luck, camera.noise, jump, limits, measured)
        return measured

    def render_rgb(self, capture: Capture, rendering: Rendering) -> NDArray[np.uint8]:
        """The view in colours, (h, w, 3), for people to look at."""
        picture = np.empty((*rendering.depth.shape, 3), dtype=np.uint8)
        _, centre, half, yaw, colour = capture.shapes
        kind, rotation = capture.shapes.kind, np.ascontiguousarray(capture.rotation)
        focal = self._camera.focal_length_px
        shade(kind, centre, half, yaw, colour, capture.position, rotation, focal, *rendering, picture)
        return picture

    def frame(self, capture: Capture, index: int, colour: bool = False) -> DepthFrame:
        """A whole frame."""
        rendering = self.render(capture)
        picture = self.render_rgb(capture, rendering) if colour else None
        return DepthFrame(index, self.measure(rendering, index), picture)


class DepthCameraWorker:
    """Renders in a thread of its own while the simulation goes on.

    A frame is started at the instant of its capture and fetched at the instant of its delivery; the result
    depends on the capture and the frame's number alone, never on how fast the thread was.
    """

    def __init__(self, renderer: DepthRenderer) -> None:
        self._renderer = renderer
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="depth_camera")
        self._started: list[Future[DepthFrame]] = []

    def start(self, capture: Capture, index: int, colour: bool = False) -> None:
        """Begin frame `index`; several may be under way."""
        self._started.append(self._pool.submit(self._renderer.frame, capture, index, colour))

    def result(self) -> DepthFrame:
        """The oldest frame not fetched yet, waiting for it; RuntimeError when none has been started."""
        if not self._started:
            raise RuntimeError("no frame has been started")
        return self._started.pop(0).result()

    def close(self) -> None:
        """End the thread; frames not fetched are lost."""
        self._pool.shutdown(cancel_futures=True)


@njit(cache=True, nogil=True, error_model="numpy")
def spoil(
    depth: NDArray[np.float32],
    noise: NDArray[np.float32],
    luck: NDArray[np.float32],
    sigma: float,
    jump: float,
    limits: tuple[float, float],
    out: NDArray[np.float32],
) -> None:
    """Range limits, noise `sigma * z^2`, and dropouts where depth changes by more than `jump` per pixel.

    Only neighbours in the same row count: projector and lens of a structured-light camera lie side by side,
    so shadows fall sideways. noise: standard normal, luck: uniform in 0..1, both (h, w), or both empty for a
    perfect camera.
    """
    rows, columns = depth.shape
    real = noise.size > 0
    for v in range(rows):
        for u in range(columns):
            z = depth[v, u]
            if real and luck[v, u] < DROPOUT:
                left, right = depth[v, max(u - 1, 0)], depth[v, min(u + 1, columns - 1)]
                if max(abs(left - z), abs(right - z)) > jump * z:
                    z = np.float32(np.nan)
            if real:
                z += np.float32(sigma) * z * z * noise[v, u]
            out[v, u] = z if limits[0] <= z <= limits[1] else np.nan
