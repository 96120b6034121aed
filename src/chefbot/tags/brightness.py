"""Brightness of a grey image between its pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def brightness_at(
    grey: NDArray[np.uint8], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the brightness at points (n,), by bilinear interpolation; outside, that of the nearest pixel."""
    from scipy import ndimage  # takes half a second, and few robots have tags

    values: NDArray[np.float64] = ndimage.map_coordinates(grey, (y, x), np.float64, order=1, mode="nearest")
    return values
