"""Map files as ROS has them: a picture and a YAML file about it (wiki.ros.org/map_server, nav2_map_server).

Bytes in, bytes out; reading and writing of files is elsewhere.
"""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chefbot.config import parse_yaml
from chefbot.errors import UserError, nearest
from chefbot.mapping.image_format import MAX_CELLS, Picture, check_size, decode_image
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid

Mode = Literal["trinary", "scale", "raw"]
OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196
"""map_server's; with Nav2's 0.25 its own grey for unknown would be read as free."""
BLACK, GREY, WHITE = 0, 205, 254
"""map_saver's pixels for occupied, unknown and free."""
_REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_IGNORED = ("frame_id",)
"""Written by some tools; says nothing about the cells."""
_CHECKSUM = re.compile(rb"^# image sha256: ([0-9a-f]{64})\s*$", re.MULTILINE)
_FARTHEST = 1e7  # m, beyond which an origin is a mistake
_BLOCK = 1_000_000  # cells turned at once


@dataclass(frozen=True)
class MapDescription:
    """The YAML file. origin: x, y (m) and yaw (rad) of the picture's lower left corner in the map frame."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: Mode
    checksum: str | None
    """SHA-256 of the picture, where the writer left it."""


def encode_pgm(grid: Grid, mode: Mode = "trinary") -> bytes:
    """The picture as P5. Trinary keeps free, occupied and unknown, which is what AMCL and planners use;

    raw keeps every percentage, dark as it looks; scale needs transparency, which a PGM lacks: ValueError.
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
        raise ValueError(f"a PGM cannot hold a map of mode {mode!r}")
    pixels = table[grid.cells[::-1].view(np.uint8)]  # -1 is seen as 255
    return b"P5\n%d %d\n255\n" % (grid.width, grid.height) + pixels.tobytes()


def encode_map_yaml(image_name: str, grid: Grid, mode: Mode = "trinary", image: bytes | None = None) -> bytes:
    """The YAML file. With the picture's bytes `image` given, a comment tells their SHA-256."""
    if not re.fullmatch(r"[^\x00-\x1f\x7f]+", image_name):
        raise UserError(f"a map's picture cannot be called {image_name!r}; use printable characters")
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
    """The YAML file's content, checked. UserError, beginning with `where`, when it is none."""
    keys = parse_yaml(data, where)
    if not isinstance(keys, dict):
        raise UserError(f"{where} is not a list of keys and values as a map's YAML file is")
    for key in keys:
        if key not in (*_REQUIRED, "mode", *_IGNORED):
            raise UserError(f"{where}: unknown key {key!r}{nearest(str(key), [*_REQUIRED, 'mode'])}")
    missing = [key for key in _REQUIRED if key not in keys]
    if missing:
        raise UserError(f"{where}: {missing[0]!r} is missing")
    return _check_thresholds(_to_description(keys, _CHECKSUM.search(data), where), where)


def _to_description(keys: dict[str, Any], checksum: re.Match[bytes] | None, where: str) -> MapDescription:
    image, origin, mode = keys["image"], keys["origin"], keys.get("mode", "trinary")
    if not isinstance(image, str) or not image or "\0" in image:
        raise UserError(f"{where}: image must be the name of a PGM or PNG file, not {image!r:.40}")
    if not isinstance(origin, list) or len(origin) != 3:
        raise UserError(f"{where}: origin must be [x, y, yaw], not {origin!r:.40}")
    if mode not in get_args(Mode):
        raise UserError(f"{where}: no mode is called {mode!r:.40}{nearest(str(mode), get_args(Mode))}")
    if keys["negate"] not in (0, 1):
        raise UserError(f"{where}: negate must be 0 or 1, not {keys['negate']!r:.40}")
    x, y, yaw = (_number(value, -_FARTHEST, _FARTHEST, "origin", where) for value in origin)
    return MapDescription(
        image,
        _number(keys["resolution"], 1e-4, 100.0, "resolution", where),
        (x, y, yaw),
        bool(keys["negate"]),
        _number(keys["occupied_thresh"], 0.0, 1.0, "occupied_thresh", where),
        _number(keys["free_thresh"], 0.0, 1.0, "free_thresh", where),
        mode,
        checksum[1].decode() if checksum else None,
    )


def _number(value: Any, least: float, most: float, key: str, where: str) -> float:
    """A finite number within bounds; as text too, since YAML 1.1 takes `5e-2` for text."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not least <= number <= most:
        raise UserError(f"{where}: {key} must be a number from {least:g} to {most:g}, not {value!r:.40}")
    return number


def _check_thresholds(about: MapDescription, where: str) -> MapDescription:
    free, occupied = about.free_thresh, about.occupied_thresh
    if free > occupied or (free == occupied and about.mode == "scale"):
        raise UserError(f"{where}: free_thresh {free:g} must be below occupied_thresh {occupied:g}")
    return about


def decode_map(about: MapDescription, image: bytes, where: str) -> Grid:
    """The map of a picture and its description; `where` names the picture in a UserError.

    A picture that is turned (yaw) is resampled onto the axes of the map frame: nearest cell, UNKNOWN outside.
    """
    if about.checksum is not None and hashlib.sha256(image).hexdigest() != about.checksum:
        raise UserError(
            f"{where} is not the picture that its YAML file was written for; restore it,"
            " or remove the line 'image sha256' from the YAML file if you changed the picture yourself"
        )
    cells = _cells(decode_image(image, where), about)[::-1]
    x, y, yaw = about.origin
    if yaw == 0.0:
        return Grid(np.ascontiguousarray(cells), about.resolution, x, y)
    return _turned(cells, about, where)


def _cells(picture: Picture, about: MapDescription) -> NDArray[np.int8]:
    """Values by brightness, looked up, since a picture has few levels. Top row first.

    In trinary mode opacity counts as a fourth colour, as map_server and Nav2 have it; in scale mode a pixel
    that is not opaque is unknown; raw mode looks at neither opacity nor negate.
    """
    levels, white, opacity = picture.levels, picture.white, picture.opacity
    if about.mode == "trinary" and opacity is not None:  # colours then are three channels of 255
        levels, white = levels + opacity, white + 255
    cells = _table(about, white)[levels]
    if about.mode == "scale" and opacity is not None:
        cells[opacity < 255] = UNKNOWN
    return cells


def _table(about: MapDescription, white: int) -> NDArray[np.int8]:
    """Cell value of every level 0..white. p = (255 - x) / 255, or x / 255 when negated."""
    level = np.arange(white + 1)
    if about.mode == "raw":
        value = np.round(255.0 * level / white)
        return np.where(value <= 100, value, UNKNOWN).astype(np.int8)
    p = level / white if about.negate else (white - level) / white
    between = np.full(white + 1, float(UNKNOWN))
    if about.mode == "scale":
        between = np.trunc(99.0 * (p - about.free_thresh) / (about.occupied_thresh - about.free_thresh))
    table = np.where(p > about.occupied_thresh, OCCUPIED, np.where(p < about.free_thresh, FREE, between))
    return table.astype(np.int8)


def _turned(cells: NDArray[np.int8], about: MapDescription, where: str) -> Grid:
    """Cells (h, w), low row first, with axes turned by the origin's yaw, on the axes of the map frame."""
    (h, w), (x, y, yaw) = cells.shape, about.origin
    c, s = math.cos(yaw), math.sin(yaw)
    corners_x, corners_y = np.array([[0.0, c * w, -s * h, c * w - s * h], [0.0, s * w, c * h, s * w + c * h]])
    left, low = float(corners_x.min()), float(corners_y.min())  # in cells, from the origin
    width, height = (math.ceil(np.ptp(corners) - 1e-6) for corners in (corners_x, corners_y))
    check_size(width, height, f"{where}, turned by {yaw:g} rad,", MAX_CELLS)
    turned = np.full((height, width), UNKNOWN, np.int8)
    _sample(cells, turned, left, low, yaw)
    _keep_walls(cells, turned, left, low, yaw)
    return Grid(turned, about.resolution, x + left * about.resolution, y + low * about.resolution)


def _sample(cells: NDArray[np.int8], turned: NDArray[np.int8], left: float, low: float, yaw: float) -> None:
    """Fill each of the turned cells from the one below its middle; lengths in cells."""
    (h, w), (height, width) = cells.shape, turned.shape
    c, s = math.cos(yaw), math.sin(yaw)
    across = left + np.arange(width) + 0.5
    rows = max(1, _BLOCK // width)
    for begin in range(0, height, rows):
        up = low + np.arange(begin, min(begin + rows, height))[:, None] + 0.5
        column = np.floor(c * across + s * up).astype(np.int64)
        row = np.floor(c * up - s * across).astype(np.int64)
        inside = (column >= 0) & (column < w) & (row >= 0) & (row < h)
        turned[begin : begin + rows][inside] = cells[row[inside], column[inside]]


def _keep_walls(
    cells: NDArray[np.int8], turned: NDArray[np.int8], left: float, low: float, yaw: float
) -> None:
    """Carry every occupied cell over: nearest sampling alone skips some, and a thin wall would get holes."""
    c, s = math.cos(yaw), math.sin(yaw)
    row, column = np.nonzero(cells > 100 * OCCUPIED_THRESH)
    across, up = column + 0.5, row + 0.5
    x = np.floor(c * across - s * up - left).astype(np.int64)
    y = np.floor(s * across + c * up - low).astype(np.int64)
    turned[y, x] = cells[row, column]
