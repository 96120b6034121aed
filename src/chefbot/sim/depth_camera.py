"""A depth camera rendered on the CPU by ray casting, with the errors of a real one."""

from __future__ import annotations

import math
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.random import default_rng
from numpy.typing import NDArray

from chefbot.robot.sensors import DepthCamera
from chefbot.sim.capture import Capture
from chefbot.sim.depth_holes import draw_holes
from chefbot.sim.depth_raycast import draw
from chefbot.sim.realism import RealismProfile
from chefbot.sim.shading import shade
from chefbot.sim.world.shapes import MIRROR

GRAZING_ANGLE = math.radians(80.0)
"""Incidence angle across the image beyond which a surface, or an edge like one, may give no depth."""
DROPOUT = 0.7
"""Probability that such a surface gives no depth."""
DRAWS = 1 << 16
"""Number of values that a random number of a pixel can have."""


@cache
def normal_quantiles() -> NDArray[np.float32]:
    """Return (DRAWS,) quantiles of the standard normal distribution, at the middles of equal shares of it.

    Indexed by a uniform random number below DRAWS they give Gaussian noise of at most 4.3 standard deviations,
    at a small share of the time that `Generator.standard_normal` takes.
    """
    normal = NormalDist()
    return np.array([normal.inv_cdf((i + 0.5) / DRAWS) for i in range(DRAWS)], dtype=np.float32)


class DepthRendering(NamedTuple):
    """The exact view of a depth camera.

    depth: (h, w) metres along the optical axis, inf for none. number: (h, w) indices of the solids. mirrored: (h, w)
    whether a mirror reflects the pattern of light away, so that there is no depth; None where there is no mirror.
    """

    depth: NDArray[np.float32]
    number: NDArray[np.int32]
    mirrored: NDArray[np.bool_] | None = None


class DepthFrame(NamedTuple):
    """One frame of the depth camera.

    serial: frame number. depth: (h, w) metres along the optical axis, NaN where the camera measured none.
    colour: (h, w, 3) colour image, or None if it was not requested.
    """

    serial: int
    depth: NDArray[np.float32]
    colour: NDArray[np.uint8] | None


class DepthRenderer:
    """Renderer of one depth camera; noise depends only on frame number and seed, not on the call order."""

    def __init__(self, camera: DepthCamera, profile: RealismProfile = "perfect", seed: int = 0) -> None:
        self._camera, self._profile, self._seed = camera, profile, seed

    def render(self, capture: Capture) -> DepthRendering:
        """Render the exact view of a capture."""
        size = self._camera.height, self._camera.width
        depth, number = np.empty(size, dtype=np.float32), np.empty(size, dtype=np.int32)
        kind, centre, half, yaw, _, material = capture.shapes
        position, rotation = capture.position, np.ascontiguousarray(capture.rotation)
        draw(kind, centre, half, yaw, position, rotation, self._camera.focal_length_px, depth, number)
        if len(capture.holes):
            draw_holes(capture.holes, position, rotation, self._camera.focal_length_px, depth, number)
        mirrored = None
        for mirror in np.flatnonzero(material == MIRROR).tolist():
            shows_it = number == mirror
            mirrored = shows_it if mirrored is None else mirrored | shows_it
        return DepthRendering(depth, number, mirrored)

    def measure(self, rendering: DepthRendering, index: int) -> NDArray[np.float32]:
        """Return the measured depth of frame `index`: (h, w) metres, NaN out of range or dropped out."""
        camera = self._camera
        measured = np.empty_like(rendering.depth)
        max_jump = math.tan(GRAZING_ANGLE) / camera.focal_length_px
        limits = (camera.range_min, camera.range_max)
        draws = self._draws(rendering.depth.shape, index)
        quantiles = normal_quantiles()
        apply_sensor_errors(rendering.depth, draws, quantiles, camera.noise, max_jump, limits, measured)
        if rendering.mirrored is not None:
            measured[rendering.mirrored] = np.nan
        return measured

    def _draws(self, size: tuple[int, ...], index: int) -> NDArray[np.uint16]:
        """Return a uniform random number per pixel of a frame, (h, w); (0, 0) for a perfect camera."""
        rows, columns = size if self._profile != "perfect" else (0, 0)
        count = -(-rows * columns // 4)  # the generator returns 64 bits, enough for four pixels
        raw = default_rng((self._seed, index)).bit_generator.random_raw(count)
        return raw.view(np.uint16)[: rows * columns].reshape(rows, columns)

    def render_rgb(self, capture: Capture, rendering: DepthRendering) -> NDArray[np.uint8]:
        """Return the colour image of a view, (h, w, 3), for display."""
        picture = np.empty((*rendering.depth.shape, 3), dtype=np.uint8)
        kind, centre, half, yaw, colour, _ = capture.shapes
        rotation = np.ascontiguousarray(capture.rotation)
        focal = self._camera.focal_length_px
        depth, number = rendering.depth, rendering.number
        shade(kind, centre, half, yaw, colour, capture.position, rotation, focal, depth, number, picture)
        return picture

    def frame(self, capture: Capture, index: int, colour: bool = False) -> DepthFrame:
        """Render a complete frame: measured depth, and the colour image if requested."""
        rendering = self.render(capture)
        picture = self.render_rgb(capture, rendering) if colour else None
        return DepthFrame(index, self.measure(rendering, index), picture)


class DepthCameraWorker:
    """Renders frames in a worker thread while the simulation goes on.

    A frame is started at the time of its capture and fetched at the time of its delivery; the result depends
    only on the capture and the frame number, never on the speed of the thread.
    """

    def __init__(self, renderer: DepthRenderer) -> None:
        self._renderer = renderer
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="depth_camera")
        self._started: list[Future[DepthFrame]] = []

    def start(self, capture: Capture, index: int, colour: bool = False) -> None:
        """Start rendering frame `index`; several frames may be pending."""
        self._started.append(self._pool.submit(self._renderer.frame, capture, index, colour))

    def result(self) -> DepthFrame:
        """Return the oldest pending frame, waiting for it. Raises RuntimeError if none was started."""
        if not self._started:
            raise RuntimeError("no frame has been started")
        return self._started.pop(0).result()

    def close(self) -> None:
        """Stop the thread; pending frames are lost."""
        self._pool.shutdown(cancel_futures=True)


@njit(cache=True, nogil=True, error_model="numpy")
def apply_sensor_errors(
    depth: NDArray[np.float32],
    draws: NDArray[np.uint16],
    quantiles: NDArray[np.float32],
    sigma: float,
    max_jump: float,
    range_limits: tuple[float, float],
    out: NDArray[np.float32],
) -> None:
    """Apply range limits, noise `sigma * z^2`, and dropouts where depth jumps by more than `max_jump` per
    pixel.

    Only neighbours in the same row count: projector and lens of a structured-light camera lie side by side,
    so shadows fall sideways. depth, out: (h, w) metres. draws: (h, w) uniform random numbers, (0, 0) for a
    perfect camera. quantiles: see `normal_quantiles`.
    """
    rows, columns = depth.shape
    noisy = draws.size > 0
    # The low bits of a random number decide on a dropout: the noise hardly depends on them.
    low_bits, dropout = np.uint16(255), np.uint16(DROPOUT * 256)
    jump, sigma32, nan = np.float32(max_jump), np.float32(sigma), np.float32(np.nan)
    low, high = np.float32(range_limits[0]), np.float32(range_limits[1])
    for v in range(rows):
        # Noise of structured light, sigma z^2, then range limits.
        for u in range(columns):
            z = depth[v, u]
            if noisy:
                z += sigma32 * z * z * quantiles[draws[v, u]]
            out[v, u] = z if low <= z <= high else nan
        # Dropout: with probability DROPOUT no depth at occlusion edges and grazing surfaces.
        for u in range(columns if noisy else 0):
            z = depth[v, u]
            left, right = depth[v, max(u - 1, 0)], depth[v, min(u + 1, columns - 1)]
            at_edge = max(abs(left - z), abs(right - z)) > jump * z
            if at_edge and (draws[v, u] & low_bits) < dropout:
                out[v, u] = nan
