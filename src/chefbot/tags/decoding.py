"""The squares of a tag in an image: which are white, and how clearly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.tags.brightness import brightness_at

MIN_SCALE = 1e-3
"""Third coordinate of a projected point, 1 in the middle of the square, below which it is beyond the horizon."""


class TagReading(NamedTuple):
    """The squares of what may be a tag.

    white: (n, n) its data squares. wrong_border: squares of its black border that are not dark. contrast: difference
    in brightness of the white and the black border, grey levels. margin: mean distance of the data squares from the
    threshold between them.
    """

    white: NDArray[np.bool_]
    wrong_border: int
    contrast: float
    margin: float


def read_squares(grey: NDArray[np.uint8], homography: NDArray[np.float64], n: int) -> TagReading:
    """Read a tag of n x n data squares within a black border, which is within a white one.

    Corners on one line, as no camera sees them, give no contrast. homography: (9,), from the square from (-1, -1) to
    (1, 1), y down, to the outer edge of the black border in the image.
    """
    across = n + 2
    centres = (2.0 * np.arange(-1, across + 1) + 1.0) / across - 1.0
    x, y = np.meshgrid(centres, centres)
    image = homography.reshape(3, 3) @ np.array([x.ravel(), y.ravel(), np.ones(x.size)])
    if not (image[2] > MIN_SCALE).all():
        return TagReading(np.zeros((n, n), np.bool_), 4 * (n + 1), 0.0, 0.0)
    seen = brightness_at(grey, image[0] / image[2], image[1] / image[2]).reshape(x.shape)
    outside, border, data = _frame(seen, 0), _frame(seen, 1), seen[2:-2, 2:-2]
    threshold = (float(outside.mean()) + float(border.mean())) / 2.0
    wrong_border = int(np.count_nonzero(border > threshold))
    contrast, margin = float(outside.mean() - border.mean()), float(np.abs(data - threshold).mean())
    return TagReading(data > threshold, wrong_border, contrast, margin)


def _frame(values: NDArray[np.float64], inset: int) -> NDArray[np.float64]:
    """Return the outermost values of a square array (n, n) without its `inset` outer rows and columns."""
    inner = values[inset : len(values) - inset, inset : len(values) - inset]
    return np.concatenate([inner[0], inner[-1], inner[1:-1, 0], inner[1:-1, -1]])
