"""Pixels of the pictures of colour and grey cameras."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import ScanError, name_hint
from chefbot.msgs.sensor_msgs import Image

COLOR_ENCODINGS = ("rgb8", "bgr8", "mono8")
"""Supported encodings of a picture (sensor_msgs/image_encodings.hpp)."""


def rgb_pixels(image: Image) -> NDArray[np.uint8]:
    """Return the picture as red, green and blue (h, w, 3).

    ScanError for another encoding, such as one of depth; InvalidMessageError for an image without pixels.
    """
    if image.encoding not in COLOR_ENCODINGS:
        hint = name_hint(image.encoding, COLOR_ENCODINGS)
        raise ScanError(f"image encoding {image.encoding[:20]!r} is not one of a picture{hint}")
    pixels = image.pixels.astype(np.uint8, copy=False)
    if image.encoding == "mono8":
        return np.repeat(pixels[:, :, np.newaxis], 3, axis=2)
    return pixels[:, :, ::-1] if image.encoding == "bgr8" else pixels
