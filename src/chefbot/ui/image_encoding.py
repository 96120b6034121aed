"""Camera images reduced in size for a browser."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from chefbot.ui import protocol

WIDTH = 320
"""Maximum width of an image, pixels."""
QUALITY = 70
"""JPEG quality."""
MIN_DEPTH, MAX_DEPTH = 0.4, 5.0
"""Range of the colour map, m."""
_ANCHORS = np.array(
    [(170, 20, 20), (240, 120, 30), (230, 220, 60), (60, 190, 130), (50, 110, 220), (40, 30, 110)]
)
_COLORS = np.stack([np.interp(np.linspace(0, 5, 256), range(6), channel) for channel in _ANCHORS.T], axis=1)
_COLOR_MAP = _COLORS.astype(np.uint8)


def jpeg(image: NDArray[Any]) -> bytes:
    """Encode an RGB uint8 (h, w, 3) or a depth (h, w) image as JPEG, at most 320 px wide; depth in false
    colours."""
    picture = Image.fromarray(image if image.ndim == 3 else colorize_depth(image))
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, max(1, round(picture.height * WIDTH / picture.width))))
    out = io.BytesIO()
    picture.save(out, "JPEG", quality=QUALITY)
    return out.getvalue()


def colorize_depth(depth: NDArray[Any]) -> NDArray[np.uint8]:
    """Convert depth (h, w), float metres or uint16 millimetres, to RGB: red is near, blue far, black unknown."""
    metres = depth / 1000.0 if depth.dtype == np.uint16 else depth
    valid = np.isfinite(metres) & (metres > 0)
    # Normalize depth to [0, 1] between MIN_DEPTH and MAX_DEPTH; invalid pixels are black.
    fraction = np.clip((np.where(valid, metres, MAX_DEPTH) - MIN_DEPTH) / (MAX_DEPTH - MIN_DEPTH), 0, 1)
    colours = _COLOR_MAP[(fraction * 255).astype(np.uint8)]
    return np.where(valid[:, :, None], colours, np.uint8(0))


def shown_image(value: NDArray[Any]) -> NDArray[Any]:
    """Return a copy of a colour or depth image. Raises TypeError for anything else."""
    rgb = value.dtype == np.uint8 and value.ndim == 3 and value.shape[2] == 3
    depth = value.dtype in (np.float32, np.float64, np.uint16) and value.ndim == 2
    if not (rgb or depth) or value.size == 0:
        raise TypeError(f"expected RGB uint8 (h, w, 3) or depth (h, w), got {value.dtype} {value.shape}")
    return value.copy()


def encode_image(layer: str, image: NDArray[Any]) -> bytes:
    """Return the frame of a layer with an image, as JPEG."""
    return protocol.bulk(layer, {"kind": "jpeg"}, jpeg(image))
