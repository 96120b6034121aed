"""The ray kernel against MuJoCo's ray casting, on random solids."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chefbot.sim.ray_kernels import azimuths_of_box, cast_rays
from chefbot.sim.world.shapes import (
    BOX,
    CAPSULE,
    CYLINDER,
    GLASS,
    MIRROR,
    SimulatedShape,
    shape_arrays,
)
from chefbot.sim.world.world_mjcf import geom_xml

LIMIT = 8.0
GROUPS = np.array([1, 0, 0, 0, 1, 1], dtype=np.uint8)
SOUND = -1.0


def random_solids(rng: np.random.Generator, count: int) -> list[SimulatedShape]:
    """Return solids around the origin, none of which contains it."""
    solids: list[SimulatedShape] = []
    while len(solids) < count:
        kind = int(rng.choice([BOX, CYLINDER, CAPSULE]))
        x, y, z = [*rng.uniform(-9.0, 9.0, 2).tolist(), float(rng.uniform(-0.5, 2.0))]
        half = rng.uniform(0.02, 2.0, 3).tolist()
        half = half if kind == BOX else [half[0], half[0], half[2]]
        shape = SimulatedShape(
            kind, x, y, z, tuple(half), float(rng.uniform(-7.0, 7.0)), (9, 9, 9), f"s{len(solids)}"
        )
        if math.hypot(x, y) > math.hypot(half[0], half[1]) + 0.1 or shape.bottom > 0.6 or shape.top < 0.4:
            solids.append(shape)
    return solids


def random_rays(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return unit vectors in all directions, most of them nearly horizontal, and the vertical ones."""
    rays = rng.normal(size=(count, 3)) * [1.0, 1.0, 0.2]
    rays[:2] = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def cast(
    solids: list[SimulatedShape], rays: np.ndarray, glass: float = SOUND
) -> tuple[np.ndarray, np.ndarray]:
    kind, centre, half, yaw, _, material = shape_arrays(solids)
    return cast_rays((kind, centre, half, yaw, material), True, np.array([0.0, 0.0, 0.5]), rays, LIMIT, glass)


def by_mujoco(solids: list[SimulatedShape], rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    geoms = "".join(geom_xml(solid) for solid in solids)
    floor = '<geom name="floor" type="plane" size="0 0 1"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{floor}{geoms}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    count = len(rays)
    ids, distances, normals = np.zeros(count, np.int32), np.zeros(count), np.zeros(3 * count)
    origin = np.array([0.0, 0.0, 0.5])
    mujoco.mj_multiRay(
        model, data, origin, rays.ravel(), GROUPS, True, -1, ids, distances, normals, count, 100.0
    )
    distances[(ids < 0) | (distances > LIMIT)] = np.inf
    return distances, normals.reshape(-1, 3)


@given(seed=st.integers(0, 2**31), count=st.integers(0, 40))
@example(seed=0, count=40)
def test_rays_end_where_those_of_mujoco_end(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    solids, rays = random_solids(rng, count), random_rays(rng, 300)
    distance, normal = cast(solids, rays)
    expected, expected_normal = by_mujoco(solids, rays)
    same = np.isclose(distance, expected, atol=1e-5) | (np.isinf(distance) & np.isinf(expected))
    assert (~same).sum() <= 1, "at most one ray grazes an edge within the rounding error"
    hit = same & np.isfinite(distance)
    agree = np.abs(np.sum(normal * expected_normal, axis=1)) > 0.999
    assert (hit & ~agree).sum() <= 1


@given(
    x=st.floats(-5.0, 5.0),
    y=st.floats(-5.0, 5.0),
    half_x=st.floats(0.01, 3.0),
    half_y=st.floats(0.01, 3.0),
)
def test_the_azimuths_of_a_box_contain_its_corners(x: float, y: float, half_x: float, half_y: float) -> None:
    low, high = azimuths_of_box((x, y, 0.0), (half_x, half_y, 1.0))
    assert low <= high <= low + 2.0 * math.pi + 1e-12
    for corner_x, corner_y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        azimuth = math.atan2(corner_y * half_y - y, corner_x * half_x - x)
        above = (azimuth - low + 1e-9) % (2.0 * math.pi)
        assert above <= high - low + 2e-9


def wall(material: int, x: float = 2.0) -> SimulatedShape:
    return SimulatedShape(BOX, x, 0.0, 0.5, (0.01, 3.0, 0.5), 0.0, (9, 9, 9), f"wall_{x}", material)


@pytest.mark.parametrize(("degrees", "distance"), [(0.0, 1.99), (4.9, 1.99), (5.1, 3.99), (30.0, 3.99)])
def test_light_returns_from_glass_at_a_right_angle(degrees: float, distance: float) -> None:
    angle = math.radians(degrees)
    ray = np.array([[math.cos(angle), math.sin(angle), 0.0]])
    found, _ = cast([wall(GLASS), wall(0, 4.0)], ray, math.cos(math.radians(5.0)))
    assert found[0] == pytest.approx(distance / math.cos(angle), abs=1e-9)


def test_a_mirror_shows_what_is_behind_the_sensor() -> None:
    found, _ = cast([wall(MIRROR), wall(0, -1.0)], np.array([[1.0, 0.0, 0.0]]), math.cos(math.radians(5.0)))
    assert found[0] == pytest.approx(1.99 + 1.99 + 0.99, abs=1e-6)
    assert cast([wall(MIRROR), wall(0, -1.0)], np.array([[1.0, 0.0, 0.0]]))[0][0] == pytest.approx(1.99)
