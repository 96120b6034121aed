"""A depth camera rendered on the CPU by ray casting, with the errors of a real one."""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.random import default_rng
from numpy.typing import NDArray

from chefbot.robot.sensors import DepthCamera
from chefbot.sim.cameras.capture import Capture
from chefbot.sim.cameras.picture_renderer import PictureRenderer, Rendering
from chefbot.sim.realism import RealismProfile

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


class DepthFrame(NamedTuple):
    """One frame of the depth camera.

    serial: frame number. depth: (h, w) metres along the optical axis, NaN where the camera measured none.
    colour: (h, w, 3) colour image, or None if it was not requested.
    """

    serial: int
    depth: NDArray[np.float32]
    colour: NDArray[np.uint8] | None


class DepthRenderer(PictureRenderer):
    """Renderer of one depth camera; noise depends only on frame number and seed, not on the call order."""

    def __init__(self, camera: DepthCamera, profile: RealismProfile = "perfect", seed: int = 0) -> None:
        super().__init__(camera)
        self._camera, self._profile, self._seed = camera, profile, seed

    def measure(self, rendering: Rendering, index: int) -> NDArray[np.float32]:
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

    def frame(self, capture: Capture, index: int, colour: bool = False) -> DepthFrame:
        """Render a complete frame: measured depth, and the colour image if requested."""
        rendering = self.render(capture)
        picture = self.render_rgb(capture, rendering) if colour else None
        return DepthFrame(index, self.measure(rendering, index), picture)


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
