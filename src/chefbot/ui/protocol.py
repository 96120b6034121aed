"""The protocol between server and browser. This docstring is its specification;
`static/wire.js` is the browser's side.

Browser to server: JSON text, one command per message, see `commands`.

Server to browser, as text (small layers and answers):
    {"layer": NAME, "value": ...}    the latest value; null clears the layer
    {"refused": SENTENCE}            the answer to a command that was refused
    {"pong": NUMBER}                 the answer to a ping, after all that was sent before it
    {"connected": SERVER, "last_ping": NUMBER, "role": ROLE, "has_map": BOOLEAN}   first message to a browser whose
                                     address has `page=NAME`: a name that is another one after a restart, the last
                                     ping from this page, also on an earlier connection, the role of its visitor, and
                                     whether a map follows; what the page sent before that ping has arrived

Server to browser, as bytes (bulk layers), in pieces, so that on a slow link small layers pass between them: each
begins with a byte, 1 if more pieces of the layer follow and 0 in the last. Together they are the
header length (uint16, little-endian), the header (JSON) and the body.
    every header                      layer, kind
    kind "points"                     columns, x, y, unit: body int16 (n, columns), little-endian; times
                                      unit[column], plus x or y for the first two: metres, metres, radians;
                                      frame: that of the sensor, or empty
    kind "int8" or "uint8"            width, height, resolution, x, y: body zlib of the rows, low y first;
                                      (x, y) is the outer corner of the first cell, metres; yaw of the rows, radians
    kind "depth"                      width, height, focal, cx, cy (pixels), frame (an optical one, REP-103):
                                      body zlib of the rows from the top, uint16 millimetres, 0 for none
    kind "jpeg"                       body is the image

Points are sent as signed 16 bit: centimetres up to 327 m from the first point, coarser beyond, so that no
coordinate can wrap. Numbers that are not finite are sent as null.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

Frame = str | bytes
CENTIMETRE = 0.01
"""Resolution of positions, m."""
MILLIRADIAN = 0.001
"""Resolution of angles, rad."""


@dataclass(frozen=True, eq=False)
class GridImage:
    """A copy of a grid in the map frame: cells (h, w) int8 or uint8, cell size in m, corner in m, yaw of its rows."""

    cells: NDArray[Any]
    resolution: float
    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True, eq=False)
class DepthImage:
    """A decimated depth image: (h, w) uint16 millimetres, its intrinsics in its own pixels, its optical
    frame."""

    millimetres: NDArray[np.uint16]
    pinhole: dict[str, float]
    frame: str


PIECE = 4096
"""Size of a piece of a bulk layer, bytes: 0.2 s of a link of 20 kB/s."""
_MORE, _LAST = b"\x01", b"\x00"


def split_into_pieces(frame: bytes) -> list[bytes]:
    """Return the messages in which a bulk layer is sent."""
    parts = [frame[i : i + PIECE] for i in range(0, len(frame), PIECE)]
    return [_MORE + part for part in parts[:-1]] + [_LAST + parts[-1]]


class PieceAssembler:
    """Puts the pieces of bulk layers together; `limit` is the maximum size of a layer, bytes."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._parts: list[bytes] = []

    def add(self, piece: bytes) -> bytes | None:
        """Return the bulk layer whose last piece this is, else None; ValueError for an invalid piece."""
        self._parts.append(piece[1:])
        if piece[:1] not in (_MORE, _LAST) or sum(map(len, self._parts)) > self._limit:
            raise ValueError("not a piece of a layer, or too large a layer")
        if piece[:1] == _MORE:
            return None
        whole, self._parts = b"".join(self._parts), []
        return whole


def pong(number: int) -> str:
    """Encode the answer to a ping."""
    return msgspec.json.encode({"pong": number}).decode()


def connected(server: str, last_ping: int, role: str, has_map: bool) -> str:
    """Encode the first message to a page."""
    message = {"connected": server, "last_ping": last_ping, "role": role, "has_map": has_map}
    return msgspec.json.encode(message).decode()


def text(layer: str, value: Any) -> str:
    """Encode a small layer as JSON."""
    return msgspec.json.encode({"layer": layer, "value": value}).decode()


def refused(sentence: str) -> str:
    """Encode the answer to a command that was refused."""
    return msgspec.json.encode({"refused": sentence}).decode()


def bulk(layer: str, header: dict[str, Any], body: bytes) -> bytes:
    """Encode a bulk layer: header length, header, body."""
    head = msgspec.json.encode({"layer": layer, **header})
    return struct.pack("<H", len(head)) + head + body


def points(layer: str, rows: NDArray[np.float64], frame: str = "") -> bytes:
    """Encode points (n, 2) or poses (n, 3) with finite numbers, relative to the first one; `frame` is the
    sensor's."""
    columns = rows.shape[1]
    head = {"kind": "points", "columns": columns, "frame": frame}
    if len(rows) == 0:
        return bulk(layer, head | {"x": 0, "y": 0, "unit": [1] * columns}, b"")
    x, y = float(rows[0, 0]), float(rows[0, 1])
    # Offsets from the first point; the unit grows with the extent so that 16 bits suffice.
    offsets = rows - np.array([x, y, 0.0])[:columns]
    unit = [max(CENTIMETRE, float(np.abs(offsets[:, :2]).max()) / 32767)] * 2 + [MILLIRADIAN] * (columns - 2)
    if columns == 3:
        # Wrap the heading to [-pi, pi].
        offsets[:, 2] = np.arctan2(np.sin(offsets[:, 2]), np.cos(offsets[:, 2]))
    body = np.rint(offsets / unit).astype("<i2").tobytes()
    return bulk(layer, head | {"x": x, "y": y, "unit": unit}, body)


def depth(layer: str, image: DepthImage) -> bytes:
    """Encode a decimated depth image, compressed."""
    height, width = image.millimetres.shape
    header = {"kind": "depth", "width": width, "height": height, "frame": image.frame, **image.pinhole}
    return bulk(layer, header, zlib.compress(image.millimetres.tobytes(), 1))


def grid(layer: str, image: GridImage) -> bytes:
    """Encode a map or costmap, compressed with zlib's fastest level."""
    height, width = image.cells.shape
    header = {"kind": image.cells.dtype.name, "width": width, "height": height}
    origin = {"resolution": image.resolution, "x": image.x, "y": image.y, "yaw": image.yaw}
    return bulk(layer, header | origin, zlib.compress(np.ascontiguousarray(image.cells).tobytes(), 1))
