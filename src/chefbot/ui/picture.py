"""Camera pictures made small enough for a browser."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

WIDTH = 320
QUALITY = 70
NEAR, FAR = 0.4, 5.0
_ANCHORS = np.array(
    [(170, 20, 20), (240, 120, 30), (230, 220, 60), (60, 190, 130), (50, 110, 220), (40, 30, 110)]
)
_RAMP = np.stack([np.interp(np.linspace(0, 5, 256), range(6), channel) for channel in _ANCHORS.T], axis=1)
_WARM_IS_NEAR = _RAMP.astype(np.uint8)


def jpeg(image: NDArray[Any]) -> bytes:
    """JPEG, at most 320 px wide, of RGB uint8 (h, w, 3) or of depth (h, w) in false colours."""
    picture = Image.fromarray(image if image.ndim == 3 else false_colour(image))
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, max(1, round(picture.height * WIDTH / picture.width))))
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=QUALITY)
    return out.getvalue()


def false_colour(depth: NDArray[Any]) -> NDArray[np.uint8]:
    """Depth (h, w), float metres or uint16 millimetres, as RGB: red is near, blue far, black unknown."""
    metres = depth / 1000.0 if depth.dtype == np.uint16 else depth
    known = np.isfinite(metres) & (metres > 0)
    share = np.clip((np.where(known, metres, FAR) - NEAR) / (FAR - NEAR), 0, 1)
    colours = _WARM_IS_NEAR[(share * 255).astype(np.uint8)]
    return np.where(known[:, :, None], colours, np.uint8(0))
