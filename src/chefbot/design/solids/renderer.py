"""A picture of solids: parallel projection, one lamp with its shadow, ambient light and edges."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.solids.rasterizer import RasterizedView, rasterize
from chefbot.design.solids.triangulation import Mesh
from chefbot.robot.materials import RgbaColour

SIZE = (960, 800)
"""Pixels, width and height."""
SUPERSAMPLING = 2
"""Factor of supersampling."""
FILLED_SHARE = 0.86
"""Share of the picture that the solids fill, along the tighter side."""
AZIMUTH, ELEVATION = math.radians(-38.0), math.radians(28.0)
"""Direction of the camera from the solids: in front (+x), to the right (-y), above."""
LAMP = (math.radians(28.0), math.radians(58.0))
"""Azimuth and elevation."""
SHADOW_PIXELS = 1100
BIAS = 1.5
"""Bias of the shadow map, pixels, against self-shadowing."""
LAMP_SHARE, SKY_SHARE, GROUND_SHARE = 0.50, 0.62, 0.34
"""Shares of light: from the lamp, from the sky, and reflected by the ground."""
PAPER = 0.965
INK = 0.55
"""Share of the light that an edge removes."""
GAP = 12.0
"""Difference of depth between neighbours without an edge, pixels."""
CIRCLES, CORNER = (0.012, 0.04), 0.3
"""Ambient occlusion: radii over the picture's width, and strength of each."""
BAND = 100 * SUPERSAMPLING
"""Rows."""
CREASE = math.cos(math.radians(30.0))
"""Cosine between neighbours' normals below which there is an edge; chords of an arc meet at 15 degrees."""
Image = NDArray[np.float32]
UP_AXIS = np.array([[0.0, 0.0, 1.0]], np.float32)


class RenderedBody(NamedTuple):
    """A mesh in metres at its place in the scene, and its colour."""

    mesh: Mesh
    colour: RgbaColour


class _Scene(NamedTuple):
    """All triangles: corners (n, 3, 3) in metres, normals (n, 3), colours (n, 3), number of the body (n,)."""

    corners: NDArray[np.float64]
    normals: Image
    colours: Image
    body: NDArray[np.int32]


class _Eye(NamedTuple):
    """Rows of `turn`: right, down and away; a pixel is `pixel` metres wide, `corner` is the picture's (x, y)."""

    turn: NDArray[np.float64]
    pixel: float
    corner: NDArray[np.float64]

    def project(self, places: NDArray[Any]) -> NDArray[np.float64]:
        """(..., 3) metres to pixels and metres of depth."""
        seen = places @ self.turn.T
        seen[..., :2] = (seen[..., :2] - self.corner) / self.pixel
        return seen


def picture(bodies: list[RenderedBody], size: tuple[int, int] = SIZE) -> NDArray[np.uint8]:
    """Return red, green, blue (height, width, 3) of bodies that stand on a floor at their lowest point."""
    width, height = SUPERSAMPLING * size[0], SUPERSAMPLING * size[1]
    scene = _scene(bodies)
    eye = _eye(scene.corners, AZIMUTH, ELEVATION, width, height)
    seen = rasterize(eye.project(scene.corners), width, height)
    floor = float(scene.corners[..., 2].min())
    shade = 1.0 - INK * _edges(scene, seen, eye.pixel)
    lamp = _lamplight(scene, eye, seen, floor)
    sky = _open(eye, seen)
    result = np.empty((size[1], size[0], 3), np.uint8)
    for rows in _bands(height):
        light = _lit(scene, seen.triangle[rows], lamp[rows], sky[rows]) * shade[rows, :, None]
        small = light.reshape(-1, SUPERSAMPLING, size[0], SUPERSAMPLING, 3).mean(axis=(1, 3))
        result[rows.start // SUPERSAMPLING : rows.stop // SUPERSAMPLING] = np.round(
            255.0 * np.clip(small, 0.0, 1.0)
        )
    return result


def _bands(height: int) -> Iterator[slice]:
    """Bands of rows, which bound the memory."""
    for start in range(0, height, BAND):
        yield slice(start, min(start + BAND, height))


def _scene(bodies: list[RenderedBody]) -> _Scene:
    corners = np.concatenate([body.mesh.vertices[body.mesh.triangles] for body in bodies])
    counts = [len(body.mesh.triangles) for body in bodies]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    long = np.linalg.norm(cross, axis=1, keepdims=True)
    normals = np.divide(cross, long, out=np.zeros_like(cross), where=long > 0.0)
    colours = np.repeat(np.array([body.colour[:3] for body in bodies]), counts, axis=0)
    number = np.repeat(np.arange(len(bodies), dtype=np.int32), counts)
    return _Scene(corners, normals.astype(np.float32), colours.astype(np.float32), number)


def _eye(corners: NDArray[np.float64], azimuth: float, elevation: float, width: int, height: int) -> _Eye:
    """A camera directed at the centre of the corners."""
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    turn = np.array([[-sa, ca, 0.0], [ca * se, sa * se, -ce], [-ca * ce, -sa * ce, -se]])
    flat = corners.reshape(-1, 3) @ turn[:2].T
    low, high = flat.min(axis=0), flat.max(axis=0)
    pixel = float(((high - low) / (FILLED_SHARE * np.array([width, height]))).max())
    return _Eye(turn, pixel, (low + high) / 2 - pixel * np.array([width, height]) / 2)


def _normals(scene: _Scene, triangles: NDArray[np.int32]) -> Image:
    """Normals of visible faces, (..., 3); the floor's for the background."""
    return np.vstack([scene.normals, UP_AXIS])[triangles]


def _lit(scene: _Scene, triangles: NDArray[np.int32], lamp: Image, sky: Image) -> Image:
    """Colours (h, w, 3) in the light of the lamp and of the visible sky."""
    colours = np.vstack([scene.colours, np.full((1, 3), PAPER, np.float32)])[triangles]
    above = 0.5 + 0.5 * _normals(scene, triangles)[..., 2]
    soft = (GROUND_SHARE + (SKY_SHARE - GROUND_SHARE) * above) * sky
    full = LAMP_SHARE * math.sin(LAMP[1]) + SKY_SHARE  # on the floor, far from everything
    lit: Image = colours * ((LAMP_SHARE * lamp + soft) / full)[..., None].astype(np.float32)
    return lit


def _lamplight(scene: _Scene, eye: _Eye, seen: RasterizedView, floor: float) -> Image:
    """Lambert's cosine (h, w) where the lamp is seen, 0 in a shadow: a shadow map (Williams, SIGGRAPH 1978)."""
    lamp = _eye(scene.corners, *LAMP, SHADOW_PIXELS, SHADOW_PIXELS)
    nearest = rasterize(lamp.project(scene.corners), SHADOW_PIXELS, SHADOW_PIXELS).depth
    towards = -lamp.turn[2].astype(np.float32)
    cosine, shadow = np.empty(seen.depth.shape, np.float32), np.empty(seen.depth.shape, np.float32)
    for rows in _bands(len(cosine)):
        normals = _normals(scene, seen.triangle[rows])
        places = _places(eye, seen.depth[rows], rows.start, floor)
        cosine[rows] = np.maximum(normals @ towards, 0.0)
        shadow[rows] = _hidden(lamp, nearest, places + np.float32(BIAS * lamp.pixel) * normals)
    return cosine * (np.float32(1.0) - _blurred(_blurred(shadow, 3 * SUPERSAMPLING), 3 * SUPERSAMPLING))


def _hidden(lamp: _Eye, nearest: Image, places: Image) -> Image:
    """1 where a point is in the shadow of the lamp."""
    x, y, depth = np.moveaxis(lamp.project(places), -1, 0)
    column, row = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    inside = (column >= 0) & (row >= 0) & (column < SHADOW_PIXELS) & (row < SHADOW_PIXELS)
    hidden = np.zeros(inside.shape, np.float32)
    hidden[inside] = nearest[row[inside], column[inside]] < depth[inside] - BIAS * lamp.pixel
    return hidden


def _places(eye: _Eye, depth: Image, first: int, floor: float) -> Image:
    """Points of the pixels of rows from `first` on, (h, w, 3) in metres; the floor for the background."""
    height, width = depth.shape
    right, down, away = eye.turn.astype(np.float32)
    x = (np.arange(width, dtype=np.float32) + 0.5) * np.float32(eye.pixel) + np.float32(eye.corner[0])
    y = (first + np.arange(height, dtype=np.float32) + 0.5) * np.float32(eye.pixel) + np.float32(
        eye.corner[1]
    )
    known = np.where(np.isinf(depth), (floor - y[:, None] * down[2]) / away[2], depth)
    plane = x[None, :, None] * right + y[:, None, None] * down
    places: Image = (plane + known[..., None] * away).astype(np.float32)
    return places


def _open(eye: _Eye, seen: RasterizedView) -> Image:
    """How much of the sky a pixel sees: less the farther it lies behind what is round it on the picture.

    After Luft, Colditz, Deussen: Image Enhancement by Unsharp Masking the Depth Buffer, SIGGRAPH 2006; here
    what lies more than twice the circle's size behind or before is taken for something else.
    """
    result = np.ones(seen.depth.shape, np.float32)
    solid = np.where(np.isinf(seen.depth), seen.depth[np.isfinite(seen.depth)].max(), seen.depth)
    for share in CIRCLES:
        wide = share * solid.shape[1]
        behind = (solid - _blurred(solid, round(wide))) / np.float32(wide * eye.pixel)
        result -= np.float32(CORNER) * np.clip(behind, 0.0, 1.0) * np.clip(2.0 - behind, 0.0, 1.0)
    result[seen.triangle < 0] = 1.0
    return result


def _blurred(plane: Image, wide: int) -> Image:
    from scipy.ndimage import uniform_filter

    blurred: Image = uniform_filter(plane, max(wide, 1), mode="nearest")
    return blurred


def _edges(scene: _Scene, seen: RasterizedView, pixel: float) -> Image:
    """1 on a pixel whose right or lower neighbour shows another body, another face or something far behind."""
    marks = np.zeros(seen.depth.shape, np.float32)
    for here, there in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1, :], np.s_[1:, :])):
        row, column = np.nonzero(seen.triangle[here] != seen.triangle[there])
        one, other = seen.triangle[here][row, column], seen.triangle[there][row, column]
        body = np.append(scene.body, -1)
        turned = np.einsum("ij,ij->i", _normals(scene, one), _normals(scene, other)) < CREASE
        with np.errstate(invalid="ignore"):
            gap = np.abs(seen.depth[here][row, column] - seen.depth[there][row, column]) > GAP * pixel
        edge = (body[one] != body[other]) | turned | gap
        marks[row[edge], column[edge]] = 1.0
    return marks
