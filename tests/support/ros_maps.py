"""ROS maps as strangers write them: 30 in all modes, image formats, sizes and frames, each with its true cells."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from chefbot.buildings.generate import generate
from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.robot.load import load_robot
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.world import build_world, load_world

Cells = NDArray[np.int8]
Levels = NDArray[np.uint16]
ROBOT = load_robot("chefbot_lidar")
THRESHOLDS = (0.65, 0.196)
"""occupied_thresh and free_thresh of map_server."""
UTM = (448_262.35, 5_411_932.7)
"""An origin in a survey's frame, m."""


def true_map(world: str) -> Cells:
    """Return the true map of a built-in world, 5 cm a cell."""
    return floor_plan(load_world(world), ROBOT.sensors.lidar.mount.z).cells


def building(kind: str, seed: int) -> Cells:
    """Return the true map of a generated building, 5 cm a cell."""
    spec = generate(kind, seed, {}, ROBOT.circumscribed_radius)
    return floor_plan(build_world(spec, kind), ROBOT.sensors.lidar.mount.z).cells


def rooms(seed: int, size: int, thickness: int, border: int = 0, door: int = 14) -> Cells:
    """Return 2 x 2 rooms of `size` cells a side in all, joined by doors of `door` cells, with a few blocks.

    thickness: of the walls, cells. border: width of unknown cells outside.
    """
    rng = np.random.default_rng(seed)
    cells = np.zeros((size, size), np.int8)
    middle, quarter = size // 2, size // 4
    for wall in (slice(0, thickness), slice(middle, middle + thickness), slice(size - thickness, size)):
        cells[wall], cells[:, wall] = OCCUPIED, OCCUPIED
    for centre in (quarter, size - quarter):
        gap = slice(centre - door // 2, centre + door // 2)
        cells[middle : middle + thickness, gap] = FREE
        cells[gap, middle : middle + thickness] = FREE
    for row, column in rng.integers(thickness, size - size // 12, (6, 2)):
        side = max(1, size // 30)
        cells[row : row + side, column : column + side] = rng.choice([OCCUPIED, UNKNOWN])
    return np.pad(cells, border, constant_values=UNKNOWN)


# -- levels of the pixels


def grey(cells: Cells, white: int = 255, negate: bool = False) -> Levels:
    """Return the levels of trinary mode: free is white, occupied is black, unknown between the thresholds."""
    share = np.select([cells == FREE, cells == OCCUPIED], [1.0, 0.0], 0.7)
    return np.round(white * (1.0 - share if negate else share)).astype(np.uint16)


def raw(cells: Cells) -> Levels:
    """Return the levels of raw mode: the percentage itself, 255 for unknown."""
    return np.where(cells == UNKNOWN, 255, cells).astype(np.uint16)


# -- images, bytes


def p5(levels: Levels, white: int = 255, comment: str = "# CREATOR: map_saver 0.050 m/pix\n") -> bytes:
    """Return a binary PGM; a comment stands where map_saver puts it."""
    height, width = levels.shape
    pixels = levels.astype(">u2" if white > 255 else "u1").tobytes()
    return f"P5\n{comment}{width} {height}\n{white}\n".encode() + pixels


def p2(levels: Levels, white: int = 255) -> bytes:
    """Return a text PGM with comments, at most 70 characters a line."""
    height, width = levels.shape
    numbers = "\n".join(" ".join(map(str, row[i : i + 12])) for row in levels for i in range(0, width, 12))
    return f"P2 # by hand\n# a floor\n{width}\n{height} # size\n{white}\n{numbers}\n".encode()


def png(levels: NDArray[Any], mode: str) -> bytes:
    """Return a PNG of grey levels (h, w) or of channels (h, w, n), converted to Pillow's `mode`."""
    import io

    file = io.BytesIO()
    if mode == "I;16":
        Image.fromarray(levels.astype(np.uint16)).save(file, "PNG")
    else:
        Image.fromarray(levels.astype(np.uint8)).convert(mode).save(file, "PNG")
    return file.getvalue()


def with_alpha(cells: Cells, mode: str) -> bytes:
    """Return a PNG whose unknown cells are transparent: half transparent black is unknown in trinary mode too."""
    opaque = np.where(cells == UNKNOWN, 100, 255)
    colour = np.where(cells == UNKNOWN, 205, grey(cells))
    return png(np.dstack([colour, colour, colour, opaque]), "RGBA") if mode == "RGBA" else _la(colour, opaque)


def _la(colour: NDArray[Any], opaque: NDArray[Any]) -> bytes:
    return png(np.dstack([colour, opaque]), "LA")


class RosMap(NamedTuple):
    """A map as a file, and what it must be read as.

    cells: the true cells, low row first, in the image's frame. image: encodes them, top row first. yaml: keys that
    differ from the usual. picture: path of the image, relative to the YAML file or absolute after `{folder}`.
    """

    name: str
    cells: Callable[[], Cells]
    image: Callable[[Cells], bytes]
    suffix: str = ".pgm"
    resolution: float = 0.05
    origin: tuple[float, float, float] = (-3.0, 1.25, 0.0)
    yaml: str = ""
    negate: str = "0"
    thresholds: tuple[float, float] = THRESHOLDS
    picture: str = "{name}{suffix}"
    unknown: str = "auto"

    def write(self, folder: Path) -> Path:
        """Write both files; return the YAML file's path."""
        picture = self.picture.format(name=self.name, suffix=self.suffix, folder=folder)
        path = folder / picture
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.image(self.cells()[::-1]))
        lines = [
            f"image: {picture}",
            f"resolution: {self.resolution}",
            f"origin: [{', '.join(map(repr, self.origin))}]",
            f"negate: {self.negate}",
            f"occupied_thresh: {self.thresholds[0]}",
            f"free_thresh: {self.thresholds[1]}",
        ]
        yaml = folder / f"{self.name}.yaml"
        yaml.write_text("\n".join([*lines, self.yaml, ""]))
        return yaml

    def grid(self) -> Grid | None:
        """Return the map that reading must give; None for a rotated one, which is resampled."""
        x, y, yaw = self.origin
        return None if yaw else Grid(self.cells(), self.resolution, x, y)


def _small() -> Cells:
    return rooms(1, 20, 1, door=4)


def _sketch(
    seed: int, size: int = 160, thickness: int = 1, border: int = 0, door: int = 14
) -> Callable[[], Cells]:
    return lambda: rooms(seed, size, thickness, border, door)


def _known(cells: Cells) -> Cells:
    return np.where(cells == UNKNOWN, np.int8(OCCUPIED), cells)


MAPS = (
    RosMap("room_p5", lambda: true_map("room"), lambda c: p5(grey(c))),
    RosMap("workshop_p2", lambda: true_map("workshop"), lambda c: p2(grey(c))),
    RosMap("hotel_negated", lambda: true_map("hotel"), lambda c: p5(grey(c, negate=True)), negate="1"),
    RosMap("office_png", lambda: building("office", 1), lambda c: png(grey(c), "L"), ".png"),
    RosMap("home_rgb", lambda: building("home", 3), lambda c: png(grey(c), "RGB"), ".png"),
    RosMap("twins_raw", lambda: building("twins", 5), lambda c: p5(raw(c)), yaml="mode: raw"),
    RosMap("hall_scale", lambda: building("hall", 7), lambda c: with_alpha(c, "LA"), ".png", yaml="mode: scale"),
    RosMap("alpha_trinary", _sketch(1, border=9), lambda c: with_alpha(c, "RGBA"), ".png", yaml="mode: trinary"),
    RosMap("alpha_scale", _sketch(3, border=3), lambda c: with_alpha(c, "RGBA"), ".png", yaml="mode: scale"),
    RosMap("grey_16_bit", _sketch(5), lambda c: png(grey(c, 65535), "I;16"), ".png"),
    RosMap("palette", _sketch(7), lambda c: png(grey(c), "P"), ".png"),
    RosMap("one_bit", lambda: _known(rooms(9, 160, 1)), lambda c: png(grey(c), "1"), ".png"),
    RosMap("white_of_15", _sketch(11), lambda c: p5(grey(c, 15), 15)),
    RosMap("white_of_1000", _sketch(13), lambda c: p5(grey(c, 1000), 1000)),
    RosMap("p2_of_1", lambda: _known(rooms(15, 160, 1)), lambda c: p2(grey(c, 1), 1)),
    RosMap("no_comment", _sketch(17), lambda c: p5(grey(c), comment="")),
    RosMap("negated_word", _sketch(19), lambda c: p5(grey(c, negate=True)), negate="true"),
    RosMap("narrow_thresholds", _sketch(21), lambda c: p5(grey(c)), thresholds=(0.99, 0.01)),
    RosMap("raw_16_bit", _sketch(23), lambda c: png(raw(c) * 257, "I;16"), ".png", yaml="mode: raw"),
    RosMap("turned_a_little", _sketch(25), lambda c: p5(grey(c)), origin=(2.0, -1.0, 0.3)),
    RosMap("turned_a_quarter", _sketch(27), lambda c: p5(grey(c)), origin=(0.0, 0.0, math.pi / 2)),
    RosMap("turned_room", lambda: true_map("room"), lambda c: png(grey(c), "RGB"), ".png", origin=(1.0, 5.0, -2.2)),
    RosMap("far_away", _sketch(29), lambda c: p5(grey(c)), origin=(*UTM, 0.0)),
    RosMap("far_and_turned", _sketch(31), lambda c: p5(grey(c)), origin=(*UTM, 0.7)),
    RosMap("thick_walls", _sketch(33, 200, 8), lambda c: p5(grey(c)), picture="images/{name}{suffix}"),
    RosMap("thin_cells", _sketch(35, 500, 1, door=60), lambda c: p5(grey(c)), resolution=0.01),
    RosMap("twenty_cells", _small, lambda c: p5(grey(c)), resolution=0.5, picture="{folder}/{name}{suffix}"),
    RosMap("huge_cells", _sketch(37, 40, 1, door=6), lambda c: p5(grey(c)), resolution=2.0),
    RosMap("unknown_is_wall", _sketch(39, border=5), lambda c: p5(grey(c)), unknown="wall", yaml="frame_id: map"),
    RosMap("unknown_is_free", _sketch(41, border=60), lambda c: p5(grey(c)), unknown="free", yaml="mode: trinary"),
)  # fmt: skip
"""The maps; every drawn one has an odd seed."""
