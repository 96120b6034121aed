"""Decode map images, PGM and PNG, as brightness levels; headers are checked before memory is allocated."""

from __future__ import annotations

import io
import re
import struct
import warnings
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from chefbot.config import ConfigError

MAX_CELLS = 100_000_000
"""Maximum number of cells: 500 m by 500 m at 5 cm; larger is not a map of a building."""
MAX_COLOUR_CELLS = 25_000_000
"""Maximum number of pixels with colours or transparency, which need several times the memory of grey ones."""
SMALL_CELLS, MAX_CELLS_PER_BYTE = 20_000_000, 500
"""A PNG of more than the first number of pixels must have a byte of data for as many pixels as the second.

Nothing but a picture of a single colour has less, at most 1032 a byte (DEFLATE, RFC 1951).
"""
GREY_TYPE = 0
"""Type of a PNG without colours and transparency."""
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER = re.compile(rb"P[25]" + 3 * rb"(?:\s|#[^\n\r]*[\n\r])+(\d{1,10})(?!\d)")
_DAMAGED = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    IndexError,
    KeyError,
    TypeError,
    AttributeError,
    AssertionError,
    MemoryError,
    OverflowError,
    struct.error,
    zlib.error,
)
"""Exceptions that Pillow is known to raise for damaged files."""


@dataclass(frozen=True, eq=False)
class MapImage:
    """An image as brightness levels, top row first.

    levels: (height, width) uint8 or uint16; 0 is black, `white` is white.
    opacity: (height, width) uint8, 0 transparent to 255 opaque; None where the format has none.
    """

    levels: NDArray[np.uint8] | NDArray[np.uint16]
    white: int
    opacity: NDArray[np.uint8] | None = None


class MapFormatError(ConfigError):
    """A map file or its image that is damaged, contradictory or of another format."""


def decode_image(data: bytes, where: str) -> MapImage:
    """Decode a PGM (P5 or P2, white up to 65535) or PNG file; raise MapFormatError with `where` for anything else."""
    if data[:2] in (b"P5", b"P2"):
        return _decode_pgm(data, where)
    if data.startswith(PNG_SIGNATURE):
        return _decode_png(data, where)
    raise MapFormatError(f"{where} is neither a PGM (P5, P2) nor a PNG file; convert it to one of these")


def check_size(width: int, height: int, where: str, limit: int = MAX_CELLS) -> None:
    """Raise MapFormatError for an image without pixels or with too many."""
    if width < 1 or height < 1:
        raise MapFormatError(f"{where} declares {width} x {height} pixels; a map needs at least one")
    if width * height > limit:
        raise MapFormatError(f"{where} declares {width} x {height} pixels; {limit} is the maximum")


def _decode_pgm(data: bytes, where: str) -> MapImage:
    """Decode Netpbm's PGM: magic, width, height, white; one white space; then the pixels."""
    width, height, white, begin = _pgm_header(data, where)
    count = width * height
    levels = _text_levels(data, begin, where) if data[1:2] == b"2" else _levels(data, begin, count, white)
    if len(levels) < count:
        raise MapFormatError(f"{where} ends after {len(levels)} of {count} pixels; the file is truncated")
    levels = levels[:count]
    if levels.max() > white:
        raise MapFormatError(
            f"{where} has a pixel of {levels.max():.0f} above its white of {white}; it is damaged"
        )
    if white < 256:
        return MapImage(levels.astype(np.uint8, copy=False).reshape(height, width), white)
    return MapImage(levels.astype(np.uint16).reshape(height, width), white)


def _pgm_header(data: bytes, where: str) -> tuple[int, int, int, int]:
    """Return width, height, white, and where the pixels begin."""
    header = _HEADER.match(data)
    if header is None or not data[header.end() : header.end() + 1].isspace():
        raise MapFormatError(f"{where} has no complete PGM header; the file is damaged")
    width, height, white = (int(number) for number in header.groups())
    check_size(width, height, where)
    if not 1 <= white <= 65535:
        raise MapFormatError(f"{where} declares {white} as white; a PGM has 1 to 65535")
    return width, height, white, header.end() + 1


def _levels(data: bytes, begin: int, count: int, white: int) -> NDArray[np.generic]:
    """Return at most `count` pixels of a P5 file, one byte each or two in big-endian order."""
    dtype = np.dtype(">u2" if white > 255 else "u1")
    available = min(count, (len(data) - begin) // dtype.itemsize)
    return np.frombuffer(data, dtype, available, begin)


def _text_levels(data: bytes, begin: int, where: str) -> NDArray[np.generic]:
    """Return all pixels of a P2 file; float32 holds every valid value exactly and does not overflow."""
    text = re.sub(rb"#[^\n\r]*", b"", data[begin:])
    if text.translate(None, b"0123456789 \t\r\n\v\f"):
        raise MapFormatError(f"{where} has something other than numbers among its pixels; it is damaged")
    return np.fromstring(text, np.float32, sep=" ") if text.strip() else np.zeros(0, np.float32)


def _decode_png(data: bytes, where: str) -> MapImage:
    """Decode a PNG: size from the first chunk (PNG specification, 11.2.2), pixels by Pillow within its limit."""
    if len(data) < 24 or data[12:16] != b"IHDR":
        raise MapFormatError(f"{where} has no complete PNG header; the file is damaged")
    width, height = struct.unpack(">II", data[16:24])
    limit = MAX_CELLS if data[25:26] == bytes([GREY_TYPE]) else MAX_COLOUR_CELLS
    check_size(width, height, where, min(limit, Image.MAX_IMAGE_PIXELS or limit))
    if width * height > max(SMALL_CELLS, MAX_CELLS_PER_BYTE * len(data)):
        raise MapFormatError(
            f"{where} declares {width} x {height} pixels in {len(data)} bytes; so few hold no map of that size"
        )
    try:
        with warnings.catch_warnings(action="ignore"), Image.open(io.BytesIO(data), formats=["PNG"]) as image:
            if image.size != (width, height):
                raise MapFormatError(f"{where} contradicts itself about its size; it is damaged")
            image.load()
            return _to_picture(image)
    except _DAMAGED as error:
        raise MapFormatError(f"{where} cannot be read as PNG: {error}; the file is damaged") from None


def _to_picture(image: Image.Image) -> MapImage:
    if image.mode.startswith("I"):
        return _to_picture_of_16_bits(np.asarray(image).astype(np.uint16), image.info.get("transparency"))
    if image.mode in ("1", "L") and "transparency" not in image.info:
        return MapImage(np.asarray(image.convert("L")), 255)
    pixels = np.asarray(image.convert("RGBA" if image.has_transparency_data else "RGB"))
    opacity = pixels[..., 3].copy() if pixels.shape[2] == 4 else None
    return MapImage(pixels[..., :3].sum(axis=2, dtype=np.uint16), 3 * 255, opacity)


def _to_picture_of_16_bits(levels: NDArray[np.uint16], transparent: int | None) -> MapImage:
    """Return a grey image of 16 bits; a transparent level gives it the scale of colours, three channels."""
    if transparent is None:
        return MapImage(levels, 65535)
    opacity = np.where(levels == transparent, 0, 255).astype(np.uint8)
    return MapImage(np.rint(levels * (3 * 255 / 65535)).astype(np.uint16), 3 * 255, opacity)
