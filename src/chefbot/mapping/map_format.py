"""Map files as in ROS: an image and a YAML file that describes it (wiki.ros.org/map_server, nav2_map_server).

Converts from and to bytes; files are read and written elsewhere.
"""

from __future__ import annotations

import difflib
import hashlib
import math
import re
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chefbot.config import ConfigError, parse_yaml
from chefbot.errors import name_hint
from chefbot.file_kinds import MAP, check_kind
from chefbot.mapping.image_format import MAX_CELLS, MapFormatError, MapImage, check_size, decode_image
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid

Mode = Literal["trinary", "scale", "raw"]
OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196
"""Thresholds of map_server; with Nav2's 0.25 its own grey for unknown would be read as free."""
BLACK, GREY, WHITE = 0, 205, 254
"""Pixel values of map_saver for occupied, unknown and free."""
_REQUIRED_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_CHECKSUM = re.compile(rb"^# image sha256: ([0-9a-f]{64})\s*$", re.MULTILINE)
_MAX_KEYS, _SAME_WORD = 100, 0.87
_MAX_COORDINATE = 1e7  # m, limit of plausible origins
_BLOCK = 1_000_000  # cells rotated at once


@dataclass(frozen=True)
class MapDescription:
    """The YAML file of a map. origin: x, y (m), yaw (rad) of the image's lower left corner in the map frame."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: Mode
    checksum: str | None
    """SHA-256 of the image, if the writer has stored it."""


def encode_pgm(grid: Grid, mode: Mode = "trinary") -> bytes:
    """Encode the map as a P5 image.

    Trinary mode keeps free, occupied and unknown, which is what AMCL and planners use. Raw mode keeps every
    percentage, although the image looks dark. Scale mode needs transparency, which a PGM lacks: raises
    MapFormatError.
    """
    check_size(grid.width, grid.height, "the map")
    table = np.full(256, 255 if mode == "raw" else GREY, np.uint8)
    percent = np.arange(101)
    if mode == "raw":
        table[:101] = percent
    elif mode == "trinary":
        table[:101][percent / 100.0 > OCCUPIED_THRESH] = BLACK
        table[:101][percent / 100.0 < FREE_THRESH] = WHITE
    else:
        raise MapFormatError(f"a PGM cannot hold a map of mode {mode!r}")
    pixels = table[grid.cells[::-1].view(np.uint8)]  # -1 becomes index 255
    return b"P5\n%d %d\n255\n" % (grid.width, grid.height) + pixels.tobytes()


def encode_map_yaml(image_name: str, grid: Grid, mode: Mode = "trinary", image: bytes | None = None) -> bytes:
    """Encode the YAML file; if the bytes of the image are given, a comment holds their SHA-256."""
    if not re.fullmatch(r"[^\x00-\x1f\x7f]+", image_name):
        raise MapFormatError(f"a map's picture cannot be called {image_name!r}; use printable characters")
    quoted = image_name if re.fullmatch(r"[A-Za-z][\w./-]*\.\w+", image_name) else _quoted(image_name)
    lines = [
        f"image: {quoted}",
        f"mode: {mode}",
        f"resolution: {float(grid.resolution)!r}",
        f"origin: [{float(grid.origin_x)!r}, {float(grid.origin_y)!r}, 0.0]",
        "negate: 0",
        f"occupied_thresh: {OCCUPIED_THRESH}",
        f"free_thresh: {FREE_THRESH}",
    ]
    if image is not None:
        lines.append("# after a change of the picture by hand, remove the next line")
        lines.append(f"# image sha256: {hashlib.sha256(image).hexdigest()}")
    return "\n".join([*lines, ""]).encode()


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def decode_map_yaml(data: bytes, where: str) -> MapDescription:
    """Parse and validate the YAML file; raise MapFormatError, beginning with `where`, if it is invalid."""
    try:
        keys = parse_yaml(data, where)
    except ConfigError as error:
        raise MapFormatError(str(error)) from None
    if not isinstance(keys, dict):
        raise MapFormatError(f"{where} is not a list of keys and values as a map's YAML file is")
    check_kind(keys, MAP, where, MapFormatError)
    if len(keys) > _MAX_KEYS:
        raise MapFormatError(f"{where} has {len(keys)} keys; a map's YAML file has about ten")
    _check_spelling(keys, where)
    missing = [key for key in _REQUIRED_KEYS if key not in keys]
    if missing:
        raise MapFormatError(f"{where}: {missing[0]!r} is missing")
    return _check_thresholds(_to_description(keys, _CHECKSUM.search(data), where), where)


def _check_spelling(keys: dict[str, Any], where: str) -> None:
    """Raise MapFormatError for a misspelt key, also beside the right one.

    Nav2 ignores keys that it does not know, and many tools add some: only those that are nearly right are refused.
    """
    known = (*_REQUIRED_KEYS, "mode")
    for key in map(str, keys):
        if key in known:
            continue
        close = difflib.get_close_matches(key[:_MAX_KEYS], known, n=1)
        if close and (close[0] not in keys or _is_misspelling(key, close[0])):
            raise MapFormatError(f"{where}: unknown key {key!r:.60}{name_hint(key, close)}")


def _is_misspelling(key: str, known: str) -> bool:
    """Return whether a key beside the right one is hardly meant to be another: a letter or two differ."""
    return difflib.SequenceMatcher(None, key.lower(), known).ratio() > _SAME_WORD


def _to_description(keys: dict[str, Any], checksum: re.Match[bytes] | None, where: str) -> MapDescription:
    _check_values(keys, where)
    x, y, yaw = (
        _number(value, -_MAX_COORDINATE, _MAX_COORDINATE, "origin", where) for value in keys["origin"]
    )
    return MapDescription(
        keys["image"],
        _number(keys["resolution"], 1e-4, 100.0, "resolution", where),
        (x, y, yaw),
        bool(keys["negate"]),
        _number(keys["occupied_thresh"], 0.0, 1.0, "occupied_thresh", where),
        _number(keys["free_thresh"], 0.0, 1.0, "free_thresh", where),
        keys.get("mode", "trinary"),
        checksum[1].decode() if checksum else None,
    )


def _check_values(keys: dict[str, Any], where: str) -> None:
    image, origin, mode = keys["image"], keys["origin"], keys.get("mode", "trinary")
    if not isinstance(image, str) or not image or "\0" in image:
        raise MapFormatError(f"{where}: image must be the name of a PGM or PNG file, not {image!r:.40}")
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapFormatError(f"{where}: origin must be [x, y, yaw], not {origin!r:.40}")
    if mode not in get_args(Mode):
        raise MapFormatError(f"{where}: no mode is called {mode!r:.40}{name_hint(str(mode), get_args(Mode))}")
    if keys["negate"] not in (0, 1):
        raise MapFormatError(f"{where}: negate must be 0 or 1, not {keys['negate']!r:.40}")


def _number(value: Any, min_value: float, max_value: float, key: str, where: str) -> float:
    """Return a finite number within bounds; text is accepted too, since YAML 1.1 parses `5e-2` as text."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not min_value <= number <= max_value:
        raise MapFormatError(
            f"{where}: {key} must be a number from {min_value:g} to {max_value:g}, not {value!r:.40}"
        )
    return number


def _check_thresholds(description: MapDescription, where: str) -> MapDescription:
    free, occupied = description.free_thresh, description.occupied_thresh
    if free > occupied or (free == occupied and description.mode == "scale"):
        raise MapFormatError(f"{where}: free_thresh {free:g} must be below occupied_thresh {occupied:g}")
    return description


def decode_map(description: MapDescription, image: bytes, where: str) -> Grid:
    """Decode a map from its image and description; `where` names the image in a MapFormatError.

    A rotated image (yaw) is resampled onto the axes of the map frame: nearest cell, UNKNOWN outside.
    """
    if description.checksum is not None and hashlib.sha256(image).hexdigest() != description.checksum:
        raise MapFormatError(
            f"{where} is not the picture that its YAML file was written for; restore it,"
            " or remove the line 'image sha256' from the YAML file if you changed the picture yourself"
        )
    cells = _cells(decode_image(image, where), description)[::-1]
    x, y, yaw = description.origin
    if yaw == 0.0:
        return Grid(np.ascontiguousarray(cells), description.resolution, x, y)
    return on_axes_of_frame(cells, description.resolution, description.origin, where)


def _cells(picture: MapImage, description: MapDescription) -> NDArray[np.int8]:
    """Return the cell values of an image by table lookup, since it has few levels, top row first.

    As in map_server and in Nav2 up to Jazzy, except for map_saver's unknown: in trinary mode opacity counts as a
    fourth colour channel; in scale mode a pixel that is not opaque is unknown; raw mode ignores opacity and negate.
    """
    levels, white, opacity = picture.levels, picture.white, picture.opacity
    if (
        description.mode == "trinary" and opacity is not None
    ):  # colours are sums of three channels of 255 then
        levels, white = levels + opacity, white + 255
    cells = _table(description, white)[levels]
    if description.mode == "trinary" and not description.negate:
        cells[_unknown_of_map_saver(levels, white)] = UNKNOWN
    if description.mode == "scale" and opacity is not None:
        cells[opacity < 255] = UNKNOWN
    return cells


def _unknown_of_map_saver(levels: NDArray[Any], white: int) -> NDArray[np.bool_]:
    """Return which pixels are map_saver's unknown: its grey, in an image that has its white.

    Up to Jazzy, Nav2's map_saver writes a free_thresh of 0.25, by which this grey would be free.
    """
    scale = white // 255  # 257 for 16 bits, 0 for an image of fewer greys
    return (levels == GREY * scale) & (scale > 0) & (levels == WHITE * scale).any()


def _table(description: MapDescription, white: int) -> NDArray[np.int8]:
    """Return the cell value of every level 0..white, with p = (255 - x) / 255, or x / 255 if negated."""
    level = np.arange(white + 1)
    if description.mode == "raw":
        value = np.round(255.0 * level / white)
        return np.where(value <= 100, value, UNKNOWN).astype(np.int8)
    # p: occupancy probability of a brightness (map_server)
    p = level / white if description.negate else (white - level) / white
    intermediate = np.full(white + 1, float(UNKNOWN))
    if description.mode == "scale":
        intermediate = np.rint(
            100.0 * (p - description.free_thresh) / (description.occupied_thresh - description.free_thresh)
        )
    table = np.where(
        p > description.occupied_thresh, OCCUPIED, np.where(p < description.free_thresh, FREE, intermediate)
    )
    return table.astype(np.int8)


def on_axes_of_frame(
    cells: NDArray[np.int8], resolution: float, origin: tuple[float, float, float], where: str
) -> Grid:
    """Resample cells (h, w), low row first, onto the axes of a frame; every occupied cell is kept.

    origin: x, y (m), yaw (rad) of the outer corner of cell [0, 0] in the frame. where: begins a MapFormatError.
    """
    (h, w), (x, y, yaw) = cells.shape, origin
    c, s = math.cos(yaw), math.sin(yaw)
    # Corners of the rotated image, cells from the origin
    corners_x, corners_y = np.array([[0.0, c * w, -s * h, c * w - s * h], [0.0, s * w, c * h, s * w + c * h]])
    min_x, min_y = float(corners_x.min()), float(corners_y.min())
    width, height = (math.ceil(np.ptp(corners) - 1e-6) for corners in (corners_x, corners_y))
    check_size(width, height, f"{where}, turned by {yaw:g} rad,", MAX_CELLS)
    rotated = np.full((height, width), UNKNOWN, np.int8)
    _sample(cells, rotated, min_x, min_y, yaw)
    _keep_walls(cells, rotated, min_x, min_y, yaw)
    return Grid(rotated, resolution, x + min_x * resolution, y + min_y * resolution)


def _sample(
    cells: NDArray[np.int8], rotated: NDArray[np.int8], min_x: float, min_y: float, yaw: float
) -> None:
    """Fill each rotated cell from the nearest source cell; lengths in cells."""
    (h, w), (height, width) = cells.shape, rotated.shape
    c, s = math.cos(yaw), math.sin(yaw)
    x = min_x + np.arange(width) + 0.5
    rows = max(1, _BLOCK // width)
    for begin in range(0, height, rows):
        y = min_y + np.arange(begin, min(begin + rows, height))[:, None] + 0.5
        # Inverse rotation into the source image
        column = np.floor(c * x + s * y).astype(np.int64)
        row = np.floor(c * y - s * x).astype(np.int64)
        inside = (column >= 0) & (column < w) & (row >= 0) & (row < h)
        rotated[begin : begin + rows][inside] = cells[row[inside], column[inside]]


def _keep_walls(
    cells: NDArray[np.int8], rotated: NDArray[np.int8], min_x: float, min_y: float, yaw: float
) -> None:
    """Copy every occupied cell: nearest-neighbour sampling alone skips some, and a thin wall would get holes.

    Cells that touch at a corner may be two apart after the rotation, so the corner between them is copied, too.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    occupied = cells > 100 * OCCUPIED_THRESH
    row, column = np.nonzero(occupied)
    corner_row, corner_column = np.nonzero(_touching_corners(occupied))
    source_x = np.concatenate([column + 0.5, corner_column + 1.0])
    source_y = np.concatenate([row + 0.5, corner_row + 1.0])
    values = np.concatenate([cells[row, column], np.full(len(corner_row), OCCUPIED, np.int8)])
    x = np.floor(c * source_x - s * source_y - min_x).astype(np.int64)
    y = np.floor(s * source_x + c * source_y - min_y).astype(np.int64)
    rotated[y, x] = values


def _touching_corners(occupied: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the corners (h - 1, w - 1) at which two cells of `occupied` (h, w) touch, with none beside them."""
    low_left, low_right, high_left, high_right = (
        occupied[:-1, :-1], occupied[:-1, 1:], occupied[1:, :-1], occupied[1:, 1:]
    )  # fmt: skip
    rising, falling = low_left & high_right, low_right & high_left
    return (rising & ~(low_right | high_left)) | (falling & ~(low_left | high_right))
