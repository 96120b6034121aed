"""Pictures of colour and grey cameras become red, green and blue; others are refused by their encoding."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.errors import ScanError
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.sensor_msgs import Image
from chefbot.msgs.std_msgs import Header
from chefbot.scan.color_image import rgb_pixels

RGB = np.random.default_rng(1).integers(0, 256, (3, 5, 3), np.uint8)


def test_every_encoding_gives_red_green_and_blue() -> None:
    assert np.array_equal(rgb_pixels(Image.of(Header(), "rgb8", RGB)), RGB)
    assert np.array_equal(rgb_pixels(Image.of(Header(), "bgr8", RGB[:, :, ::-1])), RGB)
    grey = rgb_pixels(Image.of(Header(), "mono8", RGB[:, :, 0]))
    assert np.array_equal(grey, RGB[:, :, [0, 0, 0]])


def test_rows_may_be_padded() -> None:
    padded = np.pad(RGB[:, :, 0], ((0, 0), (0, 3)))
    image = Image(Header(), 3, 5, "mono8", 0, 8, padded.reshape(-1))
    assert np.array_equal(rgb_pixels(image)[:, :, 1], RGB[:, :, 0])


@pytest.mark.parametrize("encoding", ["16UC1", "yuv422", ""])
def test_other_encodings_are_named(encoding: str) -> None:
    with pytest.raises(ScanError, match=f"image encoding '{encoding}' is not one of a picture"):
        rgb_pixels(Image(Header(), 1, 1, encoding, 0, 2, np.zeros(2, np.uint8)))


def test_an_image_without_pixels_is_refused() -> None:
    with pytest.raises(InvalidMessageError):
        rgb_pixels(Image(Header(), 0, 0, "rgb8"))
