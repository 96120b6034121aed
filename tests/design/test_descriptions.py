"""URDF and MJCF of every built-in robot, and of robots drawn at random, describe the same machine."""

import math
import xml.etree.ElementTree as ET

import msgspec
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.design.links import CASTER_GAP, cylinder_moments, links
from chefbot.design.mjcf import mjcf
from chefbot.design.urdf import urdf
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot

EXPECTED_LINKS = {
    "base_footprint", "base_link", "wheel_left_link", "wheel_right_link", "caster_front_link",
    "caster_back_link", "payload_link", "imu_link", "camera_link", "camera_depth_frame",
    "camera_depth_optical_frame", "ultrasonic_link",
}  # fmt: skip


@pytest.fixture(params=sorted(built_in_robots()))
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def urdf_masses(text: str) -> dict[str, float]:
    masses = {}
    for link in ET.fromstring(text).iter("link"):
        mass = link.find("inertial/mass")
        if mass is not None:
            masses[link.attrib["name"]] = float(mass.attrib["value"])
    return masses


def test_mujoco_compiles_it_and_masses_are_those_of_the_urdf(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    masses = urdf_masses(urdf(robot))
    assert sum(masses.values()) == pytest.approx(robot.total_mass, rel=1e-8)
    for name, mass in masses.items():
        assert model.body(name).mass[0] == pytest.approx(mass, rel=1e-8), name


def test_inertias_and_frames_agree(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    root = ET.fromstring(urdf(robot))
    for element in root.iter("link"):
        inertia = element.find("inertial/inertia")
        if inertia is None:
            continue
        written = [float(inertia.attrib[key]) for key in ("ixx", "iyy", "izz")]
        assert sorted(model.body(element.attrib["name"]).inertia) == pytest.approx(sorted(written), rel=1e-7)
    for joint in root.iter("joint"):
        child, origin = joint.find("child"), joint.find("origin")
        assert child is not None and origin is not None
        name = child.attrib["link"]
        if name.startswith("wheel"):
            place = [float(v) for v in origin.attrib["xyz"].split()]
            assert model.body(name).pos == pytest.approx(place, abs=1e-9)


def test_urdf_is_one_tree_with_the_usual_names(robot: Robot) -> None:
    root = ET.fromstring(urdf(robot))
    names = [link.attrib["name"] for link in root.iter("link")]
    assert len(names) == len(set(names))
    assert set(names) >= EXPECTED_LINKS
    assert ("laser" in names) == (robot.sensors.lidar is not None)
    children = [c.attrib["link"] for c in root.iter("child")]
    parents = {p.attrib["link"] for p in root.iter("parent")}
    assert sorted(children) == sorted(set(names) - {"base_footprint"})
    assert parents <= set(names)


def test_optical_frame_looks_forward(robot: Robot) -> None:
    joint = next(
        j
        for j in ET.fromstring(urdf(robot)).iter("joint")
        if j.attrib["name"] == "camera_depth_optical_joint"
    )
    origin = joint.find("origin")
    assert origin is not None
    roll, pitch, yaw = (float(v) for v in origin.attrib["rpy"].split())
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    z_axis = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr]
    assert z_axis == pytest.approx([1.0, 0.0, 0.0], abs=1e-8)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.1, 5.0), st.floats(0.02, 0.5), st.floats(0.002, 1.0))
def test_a_cylinders_moments_are_those_of_its_mass_points(mass: float, radius: float, length: float) -> None:
    rng = np.random.default_rng(0)
    r, phi = radius * np.sqrt(rng.random(200_000)), rng.uniform(0, 2 * np.pi, 200_000)
    x, y, z = r * np.cos(phi), r * np.sin(phi), rng.uniform(-length / 2, length / 2, 200_000)
    points = [mass * np.mean(a**2 + b**2) for a, b in ((y, z), (x, z), (x, y))]
    assert cylinder_moments(mass, radius, length) == pytest.approx(points, rel=0.02)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.05, 0.4), st.floats(0.02, 0.2), st.floats(0.1, 20.0), st.floats(0.1, 20.0))
def test_any_size_and_load_makes_a_valid_model(
    radius: float, diameter: float, mass: float, payload: float
) -> None:
    drawn = load_robot("chefbot")
    body = msgspec.structs.replace(drawn.body, radius=radius, mass=mass + 0.2, payload=payload)
    wheels = msgspec.structs.replace(drawn.wheels, diameter=diameter, separation=2 * radius)
    robot = msgspec.structs.replace(drawn, body=body, wheels=wheels)
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    assert model.body_mass.sum() == pytest.approx(robot.total_mass, rel=1e-7)
    base = links(robot)[0]
    assert all(moment > 0 for moment in base.inertia.moments)


def test_casters_hang_clear_and_wheels_touch_at_the_drawn_track(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    for name in ("caster_front", "caster_back"):
        geom = model.geom(name)
        assert geom.pos[2] - geom.size[0] == pytest.approx(CASTER_GAP)
    left, right = model.body("wheel_left_link"), model.body("wheel_right_link")
    assert left.pos[1] - right.pos[1] == pytest.approx(robot.wheels.separation)
    assert left.pos[2] == pytest.approx(robot.wheel_radius)


def test_full_duty_reaches_the_speed_that_the_spec_promises(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(robot.max_wheel_speed, rel=0.02)
    stall = model.actuator_forcerange[:, 1]
    assert (np.abs(data.actuator_force) < stall).all()
