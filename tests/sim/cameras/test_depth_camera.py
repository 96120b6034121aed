"""Tests the simulated depth camera against MuJoCo's ray casting, and its noise."""

import math
from functools import partial

import msgspec
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.cameras.capture import OPTICAL, Capture
from chefbot.sim.cameras.depth_camera import DepthFrame, DepthRenderer
from chefbot.sim.cameras.depth_raycast import FLOOR, NOTHING
from chefbot.sim.cameras.picture_renderer import RenderWorker
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.shapes import SimulatedShape, box, capsule, cylinder, shape_arrays
from chefbot.sim.world.world import load_world
from chefbot.sim.world.world_mjcf import geom_xml

ROBOT = load_robot("chefbot")
CAMERA = ROBOT.sensors.depth_camera
assert CAMERA is not None
SMALL = msgspec.structs.replace(CAMERA, width=80, height=60)
RENDERER = DepthRenderer(SMALL)


def depth_by_mujoco(
    capture: Capture, shapes: list[SimulatedShape], rows: int, columns: int
) -> NDArray[np.float64]:
    """Return the depth of the same view by mj_multiRay, metres, shape (rows, columns)."""
    geoms = "".join(geom_xml(s._replace(name=f"s{i}")) for i, s in enumerate(shapes))
    floor = '<geom type="plane" size="0 0 1"/>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{floor}{geoms}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    v, u = np.mgrid[0:rows, 0:columns]
    f = SMALL.focal_length_px
    rays = np.stack([(u - (columns - 1) / 2) / f, (v - (rows - 1) / 2) / f, np.ones(u.shape)], axis=-1)
    world = (rays.reshape(-1, 3) @ capture.rotation.T).astype(np.float64)
    length = np.linalg.norm(world, axis=1)
    hit, reach = np.zeros(len(world), dtype=np.int32), np.zeros(len(world))
    directions = (world / length[:, None]).ravel()
    mujoco.mj_multiRay(
        model, data, capture.position, directions, None, True, -1, hit, reach, None, len(world), 1e6
    )
    return np.where(hit >= 0, reach / length, np.inf).reshape(rows, columns)


def compare(capture: Capture, shapes: list[SimulatedShape]) -> None:
    rendered = RENDERER.render(capture).depth.astype(np.float64)
    expected = depth_by_mujoco(capture, shapes, *rendered.shape)
    near = np.minimum(rendered, expected) < 50.0  # for more the resolution of float32 is above a millimetre
    error = np.abs(rendered[near] - expected[near])
    # rays along an edge may hit or miss it
    assert error.size == 0 or np.median(error / rendered[near]) < 1e-6
    assert np.count_nonzero(error > 1e-3) <= 2, np.sort(error)[-5:]


def attitude(yaw: float, pitch: float, roll: float) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the optical frame to the world of a camera with these angles in rad."""
    cy, sy, cp, sp, cr, sr = (f(a) for a in (yaw, pitch, roll) for f in (math.cos, math.sin))
    z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    return z @ y @ x @ OPTICAL


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_random_solids_render_as_in_mujoco(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes: list[SimulatedShape] = []
    for i in range(15):
        x, y, bottom = rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(0, 1)
        a, b, c = rng.uniform(0.02, 1.0, 3)
        make = i % 3
        if make == 0:
            shapes.append(box("", SE2(x, y, rng.uniform(-3, 3)), bottom, (a, b, c), (1, 2, 3)))
        elif make == 1:
            shapes.append(cylinder("", (x, y), bottom, a / 2, b, (1, 2, 3)))
        else:
            shapes.append(capsule("", (x, y), bottom, a / 4, a + b, (1, 2, 3)))
    position = np.array([*rng.uniform(-3, 3, 2), rng.uniform(0.05, 2.5)])
    solid = [s for s in shapes if not inside(s, position)]
    rotation = attitude(rng.uniform(-3, 3), rng.uniform(-0.6, 0.6), rng.uniform(-0.3, 0.3))
    compare(Capture(position, rotation, shape_arrays(solid)), solid)


def inside(shape: SimulatedShape, at: NDArray[np.float64]) -> bool:
    """Return whether a point is inside a shape or within 5 cm, where the camera's view is not defined."""
    near = math.hypot(at[0] - shape.x, at[1] - shape.y) < shape.reach + 0.05
    return near and shape.bottom - 0.05 < at[2] < shape.top + 0.05


def test_the_hotel_renders_as_in_mujoco() -> None:
    hotel = load_world("hotel")
    for place in hotel.places.values():
        sim = Simulation(ROBOT, hotel, start=place)
        compare(sim.capture(), list(hotel.shapes_at_rest()))


def test_camera_sees_people_doors_and_dropped_boxes() -> None:
    sim = Simulation(ROBOT, load_world("hotel"), start=SE2(2.0, 1.2, 0.0))
    renderer, middle = DepthRenderer(CAMERA), (120, 160)
    mount = CAMERA.mount.x
    assert renderer.render(sim.capture()).depth[middle] > 2.0
    sim.set_door("kitchen_door", 0.0)
    for _ in range(420):
        sim.step()
    assert renderer.render(sim.capture()).depth[middle] == pytest.approx(1.08 - mount, abs=0.01)
    sim.drop_box(2.8, 1.2, (0.2, 0.5, 0.5))
    assert renderer.render(sim.capture()).depth[middle] == pytest.approx(0.7 - mount, abs=0.01)


def test_walls_floor_and_empty_space_render_correctly() -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    picture = DepthRenderer(CAMERA).render(sim.capture())
    assert (picture.number[130:] == FLOOR).all()
    assert (picture.number[:110] == NOTHING).all()
    assert np.isinf(picture.depth[:110]).all()
    row = 200
    slope = (row - (CAMERA.height - 1) / 2) / CAMERA.focal_length_px
    assert picture.depth[row, 160] == pytest.approx(CAMERA.mount.z / slope, rel=0.01)


def test_perfect_profile_is_exact_within_range_and_nan_beyond() -> None:
    sim = Simulation(ROBOT, load_world("hotel"))
    renderer = DepthRenderer(CAMERA)
    exact = renderer.render(sim.capture())
    measured = renderer.measure(exact, 0)
    seen = (exact.depth >= CAMERA.range_min) & (exact.depth <= CAMERA.range_max)
    assert np.array_equal(measured[seen], exact.depth[seen])
    assert np.isnan(measured[~seen]).all()
    assert 0 < np.count_nonzero(~seen) < seen.size / 2


def test_noise_grows_with_squared_depth_and_edges_drop_out() -> None:
    renderer = DepthRenderer(CAMERA, "real", 3)
    for distance in (1.0, 3.0):
        wall = box("", SE2(distance + 0.1, 0.0, 0.0), -5.0, (0.2, 20.0, 10.0), (9, 9, 9))
        view = Capture(np.array([0.0, 0.0, 2.0]), attitude(0.0, 0.0, 0.0), shape_arrays([wall]))
        frames = np.array([renderer.measure(renderer.render(view), i) for i in range(5)])
        assert np.nanstd(frames) == pytest.approx(CAMERA.noise * distance**2, rel=0.03)
        assert np.nanmean(frames) == pytest.approx(distance, abs=0.001)
    post = box("", SE2(1.0, 0.0, 0.0), 0.0, (0.2, 0.2, 4.0), (9, 9, 9))
    view = Capture(np.array([0.0, 0.0, 2.0]), attitude(0.0, 0.0, 0.0), shape_arrays([wall, post]))
    exact = renderer.render(view).depth
    lost = np.isnan(renderer.measure(renderer.render(view), 0))
    edge = np.abs(np.diff(exact, axis=1)) > 1.0
    assert 0.5 < lost[:, 1:][edge].mean() < 0.9
    assert lost[:, 10:100].mean() == 0.0


def test_frames_depend_on_seed_and_number_only() -> None:
    sim = Simulation(ROBOT, load_world("room"), "real", 1)
    capture = sim.capture()
    first, second = DepthRenderer(CAMERA, "real", 1), DepthRenderer(CAMERA, "real", 1)
    late = first.frame(capture, 7).depth
    assert np.array_equal(second.frame(capture, 3).depth, first.frame(capture, 3).depth, equal_nan=True)
    assert np.array_equal(second.frame(capture, 7).depth, late, equal_nan=True)
    assert not np.array_equal(second.frame(capture, 8).depth, late, equal_nan=True)
    seeded = DepthRenderer(CAMERA, "real", 2).frame(capture, 7).depth
    assert not np.array_equal(seeded, late, equal_nan=True)


def test_a_worker_returns_the_frames_in_capture_order() -> None:
    sim = Simulation(ROBOT, load_world("room"), "real", 1)
    renderer = DepthRenderer(CAMERA, "real", 1)
    worker = RenderWorker[DepthFrame]("depth_camera")
    sim.set_duty(-0.6, 0.6)
    expected = []
    for i in range(4):
        capture = sim.capture()
        worker.start(partial(renderer.frame, capture, i, i == 2))
        expected.append(renderer.frame(capture, i, colour=i == 2))
        for _ in range(20):
            sim.step()
    for frame in expected:
        got = worker.result()
        assert got.serial == frame.serial
        assert np.array_equal(got.depth, frame.depth, equal_nan=True)
        assert (got.colour is None) == (frame.colour is None)
    worker.close()
    with pytest.raises(RuntimeError, match="no image"):
        worker.result()


def test_rendered_colours_are_those_of_the_world() -> None:
    red = box("", SE2(1.0, 0.0, 0.0), 0.0, (0.2, 0.5, 0.6), (200, 10, 10))
    view = Capture(np.array([0.0, 0.0, 0.3]), attitude(0.0, 0.0, 0.0), shape_arrays([red]))
    renderer = DepthRenderer(CAMERA)
    picture = renderer.render_rgb(view, renderer.render(view))
    assert picture.shape == (CAMERA.height, CAMERA.width, 3)
    r, g, b = picture[120, 160].tolist()
    assert r > 80 and g < 20 and b < 20
    floor, sky = picture[-1, 0].tolist(), picture[0, 0].tolist()
    assert floor[0] > floor[2] and sky[2] > sky[0]
