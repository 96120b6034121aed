"""Occlusion of the sensors by the robot itself.

The part of a body inside a field of view is cut out and projected from the sensor onto a plane in front of
it, on which shares of area are shares of the picture; nothing is sampled.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chefbot.design.checks.finding import Bound, Finding, Severity, below, mm_up, nearest_valid_length
from chefbot.design.checks.part_bodies import PartBody, bodies, placement
from chefbot.robot.geometry.layout import overall_height
from chefbot.robot.geometry.shapes import rotation
from chefbot.robot.section import Mount
from chefbot.robot.sensors import Camera, Lidar, Ultrasonic
from chefbot.robot.spec import Robot

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

NEAR_PLANE_DISTANCE = 1e-4
"""Distance of the near plane from the sensor, m."""
HIDDEN_WARNING, HIDDEN_ERROR = 0.001, 0.02
"""Permitted occlusion by the robot: share of a picture, or of a cone's section."""
CONE_SIDES = 64
NOISE_RESERVE = 3.0
"""Standard deviations between the robot's farthest part and the lidar's minimum range."""
FAR_ROBOTS = 3.0
"""Distance of the far plane in footprint radii, beyond the robot."""


class Hidden(NamedTuple):
    """Share of a field of view that the robot occludes, in all and by part."""

    share: float
    by_part: dict[str, float]

    @property
    def names(self) -> str:
        """Return the names of the occluding parts, the largest first."""
        return ", ".join(sorted(self.by_part, key=lambda name: -self.by_part[name]))


class Sectors(NamedTuple):
    """Occluded angle of a scan by part, rad, and the distance of the farthest point of what occludes, m."""

    angle: float
    by_part: dict[str, float]
    farthest: float


def check_sensor_views(robot: Robot) -> Iterator[Finding]:
    """Return all findings about cameras, ultrasonic ranger and lidar."""
    sensors = robot.sensors
    if sensors.depth_camera is not None:
        yield from _view(robot, "camera", "depth_camera", "camera's picture")
    if sensors.color_camera is not None:
        yield from _view(robot, "color_camera", "color_camera", "colour camera's picture")
    if sensors.ultrasonic is not None:
        yield from _view(robot, "ultrasonic", "ultrasonic", "ultrasonic ranger's cone")
    if sensors.lidar is not None:
        yield from _scan(robot, sensors.lidar)


def _view(robot: Robot, name: str, field: str, what: str) -> Iterator[Finding]:
    hidden = hidden_from(robot, name, field)
    severity: Severity = "error" if hidden.share > HIDDEN_ERROR else "warning"
    if hidden.share <= HIDDEN_WARNING:
        return
    mount = f"sensors.{field}.mount"

    def is_valid(candidate: Robot) -> bool:
        return hidden_from(candidate, name, field, enough=HIDDEN_WARNING).share <= HIDDEN_WARNING

    key, value = nearest_valid_length(robot, [f"{mount}.x", f"{mount}.z"], is_valid)
    sentence = f"{100 * hidden.share:.3g} % of the {what} shows the robot: {hidden.names}"
    yield Finding(
        severity, "view", hidden.names, sentence, hidden.share, HIDDEN_WARNING, "", False,
        key or f"{mount}.x", value,
    )  # fmt: skip


def hidden_from(robot: Robot, name: str, field: str, enough: float = 1.0) -> Hidden:
    """Return the share of the view of the camera or of the ultrasonic ranger that the robot occludes.

    Once one part alone occludes a share of more than `enough`, the other parts are skipped.
    """
    sensor: Camera | Ultrasonic = getattr(robot.sensors, field)
    window = _picture(sensor) if isinstance(sensor, Camera) else _cone(sensor)
    turn, at = _frame(sensor.mount)
    view = _pyramid(window, FAR_ROBOTS * (robot.circumscribed_radius + overall_height(robot)))
    view = view.transform(placement(turn, at))
    full_area, shadows, by_part = _polygon_area(window), [], {}
    for body in _others(robot, name):
        if _is_outside(body, window, turn, at):
            continue
        seen = body.surface ^ view
        if not seen.is_empty():
            shadows.append(_shadow(seen, turn, at))
            by_part[body.name] = float(shadows[-1].area()) / full_area
            if by_part[body.name] > enough:
                break
    return Hidden(_union_area(shadows) / full_area, by_part)


def _is_outside(
    body: PartBody, window: NDArray[np.float64], turn: NDArray[np.float64], at: NDArray[np.float64]
) -> bool:
    """Whether the bounding box of a body lies beyond one side of a view, so that the sensor sees nothing of it."""
    rays = np.column_stack([np.ones(len(window)), window])
    normals = np.cross(rays, np.roll(rays, -1, axis=0))
    inwards = normals * np.sign(normals[:, :1])  # the axis of the view, (1, 0, 0), is inside
    return bool((_box_corners(body, turn, at) @ inwards.T < 0.0).all(axis=0).any())


def _box_corners(body: PartBody, turn: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (8, 3) of a body's bounding box in the frame of a sensor."""
    corners = np.array(list(itertools.product(*zip(body.low, body.high, strict=True))))
    return (corners - at) @ turn


def _others(robot: Robot, name: str) -> list[PartBody]:
    """All bodies but the sensor's housing and its stand."""
    return [body for body in bodies(robot) if body.name not in (name, f"{name}_stand")]


def _frame(mount: Mount) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return rotation(mount.pitch, mount.yaw), np.array((mount.x, mount.y, mount.z))


def _picture(camera: Camera) -> NDArray[np.float64]:
    """(4, 2): corners of the picture on the plane one metre ahead, y and z."""
    y = camera.width / 2.0 / camera.focal_length_px
    z = camera.half_height
    return np.array([(y, z), (-y, z), (-y, -z), (y, -z)])


def _cone(ranger: Ultrasonic) -> NDArray[np.float64]:
    """(n, 2): the cone's section one metre ahead."""
    angles = np.arange(CONE_SIDES) * 2.0 * math.pi / CONE_SIDES
    reach = math.tan(ranger.field_of_view / 2.0)
    return reach * np.column_stack([np.cos(angles), np.sin(angles)])


def _pyramid(window: NDArray[np.float64], far: float) -> Manifold:
    from manifold3d import Manifold

    rays = np.column_stack([np.ones(len(window)), window])
    return Manifold.hull_points(np.vstack([NEAR_PLANE_DISTANCE * rays, far * rays]))


def _shadow(seen: Manifold, turn: NDArray[np.float64], at: NDArray[np.float64]) -> CrossSection:
    """The projection onto the plane one metre ahead; the faces towards the sensor suffice."""
    from manifold3d import CrossSection, FillRule

    mesh = seen.to_mesh64()
    inside = (np.asarray(mesh.vert_properties)[:, :3] - at) @ turn
    flat = inside[:, 1:] / inside[:, :1]
    triangles = flat[np.asarray(mesh.tri_verts).astype(np.int64)]
    signed = _cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return CrossSection(list(triangles[signed < 0.0][:, ::-1]), FillRule.NonZero)


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    product: NDArray[np.float64] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def _union_area(shadows: Iterable[CrossSection]) -> float:
    from manifold3d import CrossSection, OpType

    return float(CrossSection.batch_boolean([CrossSection(), *shadows], OpType.Add).area())


def _polygon_area(corners: NDArray[np.float64]) -> float:
    return abs(float(_cross(corners, np.roll(corners, -1, axis=0)).sum())) / 2.0


# -- lidar


def _scan(robot: Robot, lidar: Lidar) -> Iterator[Finding]:
    """Occluded sectors, and returns from the robot that look like walls."""
    sectors = hidden_sectors(robot, lidar)
    if sectors.angle <= 0.0:
        return
    names = ", ".join(sectors.by_part)
    sentence = f"{math.degrees(sectors.angle):.3g} degrees of the lidar's turn show the robot: {names}"
    tubes = any(name.startswith("tube_") for name in sectors.by_part)
    if tubes:
        sentence += "; tubes are at every height, thinner ones hide less"
    key, value = ("tubes.bore", "") if tubes else ("sensors.lidar.mount.z", _free_height(robot))
    yield Finding(
        "warning", "view", names, sentence, sectors.angle, 0.0, "rad", False, key, value,
    )  # fmt: skip
    minimum = sectors.farthest + NOISE_RESERVE * lidar.noise
    yield from below(
        "view", names, "the lidar measures the robot itself, with noise, and takes it for a wall",
        Bound(lidar.range_min, minimum, "m"), "sensors.lidar.range_min", mm_up(minimum),
    )  # fmt: skip


def _free_height(robot: Robot) -> str:
    """Mount height without occlusion, as text; empty if there is none."""

    def is_valid(candidate: Robot) -> bool:
        lidar = candidate.sensors.lidar
        return lidar is not None and hidden_sectors(candidate, lidar).angle == 0.0

    return nearest_valid_length(robot, ["sensors.lidar.mount.z"], is_valid)[1]


def hidden_sectors(robot: Robot, lidar: Lidar) -> Sectors:
    """Return the occluded sectors of the lidar's plane; a part that is completely behind another is not named."""
    turn, at = _frame(lidar.mount)
    spans: dict[str, list[tuple[float, float]]] = {}
    farthest = 0.0
    for body in _others(robot, "laser"):
        for loop in _section(body, turn, at):
            covered = _in_view(_interval(loop), lidar.field_of_view / 2.0)
            if covered:
                spans[body.name] = spans.get(body.name, []) + covered
                farthest = max(farthest, _farthest_met(loop))
    union: list[tuple[float, float]] = []
    by_part = {}
    for name in sorted(spans, key=lambda name: -_covered(spans[name])):
        alone = _covered(union)
        union += spans[name]
        if _covered(union) > alone + 1e-9:
            by_part[name] = _covered(spans[name])
    return Sectors(_covered(union), by_part, farthest)


def _section(body: PartBody, turn: NDArray[np.float64], at: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Outer loops (n, 2) in the lidar's plane."""
    heights = _box_corners(body, turn, at)[:, 2]
    if heights.min() > 0.0 or heights.max() < 0.0:
        return []
    back = body.surface.transform(placement(turn.T, -turn.T @ at))
    loops = (np.asarray(loop) for loop in back.slice(0.0).to_polygons())
    return [loop for loop in loops if _cross(loop, np.roll(loop, -1, axis=0)).sum() > 0.0]


def _farthest_met(loop: NDArray[np.float64]) -> float:
    """Distance of the farthest point on edges that face the lidar."""
    next_corners = np.roll(loop, -1, axis=0)
    facing = _cross(loop, next_corners) < 0.0
    met = np.vstack([loop[facing], next_corners[facing]]) if facing.any() else loop
    return float(np.hypot(*met.T).max())


def _interval(loop: NDArray[np.float64]) -> list[tuple[float, float]]:
    """Directions in [-pi, pi] that a closed line covers, each edge less than half a turn."""
    start = np.arctan2(loop[:, 1], loop[:, 0])
    turned = np.angle(np.exp(1j * (np.roll(start, -1) - start)))
    spans = []
    for begin, by in zip(start.tolist(), turned.tolist(), strict=True):
        low, high = min(begin, begin + by), max(begin, begin + by)
        spans += [(low, min(high, math.pi))] + ([(-math.pi, high - 2 * math.pi)] if high > math.pi else [])
        spans += [(low + 2 * math.pi, math.pi)] if low < -math.pi else []
    return [(max(low, -math.pi), high) for low, high in spans]


def _in_view(spans: list[tuple[float, float]], half: float) -> list[tuple[float, float]]:
    """Return the parts of the intervals within `half` rad of the forward direction."""
    cut = [(max(low, -half), min(high, half)) for low, high in spans]
    return [(low, high) for low, high in cut if low < high]


def _covered(spans: list[tuple[float, float]]) -> float:
    """Total length of the union of intervals."""
    total, reached = 0.0, -math.inf
    for low, high in sorted(spans):
        total += max(high - max(low, reached), 0.0)
        reached = max(reached, high)
    return total
