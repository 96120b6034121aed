"""URDF and MJCF of every built-in robot, and of robots drawn at random, describe the machine of the solids."""

import io
import math
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import msgspec
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.design.bodies import assert_same, of_mujoco, of_solids, of_urdf

from chefbot.design.export.mjcf import mjcf, robot_xml
from chefbot.design.export.urdf import urdf
from chefbot.design.export.urdf_frames import fixed_frames, quaternion
from chefbot.robot.geometry.layout import CASTER_GAP
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.geometry.shapes import rotation
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.motion_limits import max_wheel_speed
from chefbot.robot.spec import GRAVITY, Robot
from chefbot.sim.world.world_mjcf import world_mjcf

ALWAYS = {
    "base_footprint", "base_link", "wheel_left_link", "wheel_right_link", "caster_front_link",
    "caster_back_link", "payload_link", "imu_link",
}  # fmt: skip


def expected_links(robot: Robot) -> set[str]:
    """By the usual names, as the robot's equipment is."""
    names, sensors = set(ALWAYS), robot.sensors
    if sensors.depth_camera:
        names |= {"camera_link", "camera_depth_frame", "camera_depth_optical_frame"}
    return (
        names
        | ({"laser"} if sensors.lidar else set())
        | ({"ultrasonic_link"} if sensors.ultrasonic else set())
        | ({f"cliff_{i}_link" for i in range(len(sensors.cliffs.positions))} if sensors.cliffs else set())
    )


@pytest.fixture(params=sorted(built_in_robots()))
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def turned(robot: Robot, pitch: float, yaw: float) -> Robot:
    """With the IMU mounted askew."""
    mount = msgspec.structs.replace(robot.sensors.imu.mount, pitch=pitch, yaw=yaw)
    imu = msgspec.structs.replace(robot.sensors.imu, mount=mount)
    return msgspec.structs.replace(robot, sensors=msgspec.structs.replace(robot.sensors, imu=imu))


def test_mass_centre_and_inertia_are_those_of_the_solids(robot: Robot) -> None:
    expected = of_solids(robot)
    assert sum(body.mass for body in expected.values()) == pytest.approx(total_mass(robot), rel=1e-9)
    assert_same(of_urdf(urdf(robot)), expected)
    assert_same(of_mujoco(mujoco.MjModel.from_xml_string(mjcf(robot))), expected)
    assert_same(of_mujoco(mujoco.MjModel.from_xml_string(urdf(robot))), expected)


@settings(max_examples=15)
@given(
    pitch=st.floats(-0.7, 0.7),
    yaw=st.floats(-3.0, 3.0),
    diameter=st.floats(0.07, 0.11),
    payload=st.floats(0.1, 20.0),
)
def test_any_robot_is_equal_in_every_description(
    pitch: float, yaw: float, diameter: float, payload: float
) -> None:
    drawn = turned(load_robot("chefbot_lidar"), pitch, yaw)
    body = msgspec.structs.replace(drawn.body, payload=payload)
    wheels = msgspec.structs.replace(drawn.wheels, diameter=diameter)
    robot = msgspec.structs.replace(drawn, body=body, wheels=wheels)
    own, foreign = mujoco.MjModel.from_xml_string(mjcf(robot)), mujoco.MjModel.from_xml_string(urdf(robot))
    expected = of_solids(robot)
    assert_same(of_mujoco(own), expected)
    assert_same(of_mujoco(foreign), expected)
    for frame, turn in (("camera_link", np.eye(3)), ("imu_link", rotation(pitch, yaw))):
        site, link = own.site(frame), foreign.body(frame)
        assert site.pos == pytest.approx(link.pos, abs=1e-8)
        for quat in (site.quat, link.quat):
            matrix = np.zeros(9)
            mujoco.mju_quat2Mat(matrix, quat)
            assert matrix.reshape(3, 3) == pytest.approx(turn, abs=1e-7)


def test_the_simulator_loads_this_mjcf(robot: Robot) -> None:
    from chefbot.maths.se2 import IDENTITY
    from chefbot.robot.as_built import AS_DRAWN

    body = robot_xml(robot).body
    assert body in mjcf(robot)
    assert body in world_mjcf(robot, (), (), AS_DRAWN, IDENTITY)


def test_urdf_is_one_tree_with_conventional_names(robot: Robot) -> None:
    root = ET.fromstring(urdf(robot))
    names = [link.attrib["name"] for link in root.iterfind("link")]
    assert len(names) == len(set(names))
    assert set(names) == expected_links(robot)
    children = [c.attrib["link"] for c in root.iterfind("joint/child")]
    parents = {p.attrib["link"] for p in root.iterfind("joint/parent")}
    assert sorted(children) == sorted(set(names) - {"base_footprint"})
    assert parents <= set(names)


def test_check_urdf_accepts_the_description(robot: Robot, tmp_path: Path) -> None:
    if shutil.which("check_urdf") is None:
        pytest.skip("needs check_urdf: apt-get install liburdfdom-tools")
    file, text = tmp_path / "robot.urdf", urdf(robot)
    file.write_text(text)
    done = subprocess.run(["check_urdf", str(file)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    joints = len(ET.fromstring(text).findall("joint"))
    seen = len(re.findall(r"child\(\d+\):", done.stdout))
    assert ("root Link: base_footprint" in done.stdout, seen) == (True, joints)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_yourdfpy_computes_the_same_frames(robot: Robot) -> None:
    yourdfpy = pytest.importorskip("yourdfpy", reason="needs yourdfpy from PyPI")
    robot = turned(robot, 0.3, 0.5)
    model = yourdfpy.URDF.load(io.BytesIO(urdf(robot).encode()), build_scene_graph=True, load_meshes=False)
    assert model.validate()
    assert set(model.actuated_joint_names) == {"wheel_left_joint", "wheel_right_joint"}
    for frame in fixed_frames(robot):
        matrix = model.get_transform(frame.name, frame.parent)
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, np.array(quaternion(frame.rpy)))
        assert matrix[:3, 3] == pytest.approx(frame.at, abs=1e-8), frame.name
        assert matrix[:3, :3] == pytest.approx(turn.reshape(3, 3), abs=1e-7), frame.name


@given(st.floats(-1.5, 1.5), st.floats(-math.pi, math.pi))
def test_quaternion_equals_the_rotation_of_the_solids(pitch: float, yaw: float) -> None:
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.array(quaternion((0.0, pitch, yaw))))
    assert turn.reshape(3, 3) == pytest.approx(rotation(pitch, yaw), abs=1e-12)


def test_optical_frame_looks_forward() -> None:
    frames = fixed_frames(load_robot("chefbot"))
    frame = next(frame for frame in frames if frame.name == "camera_depth_optical_frame")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, np.array(quaternion(frame.rpy)))
    right, down, forward = turn.reshape(3, 3).T
    assert forward == pytest.approx([1.0, 0.0, 0.0], abs=1e-12)
    assert right == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)
    assert down == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)


def test_ros2_control_limits_both_wheels_to_the_motor_speed(robot: Robot) -> None:
    block = ET.fromstring(urdf(robot)).find("ros2_control")
    assert block is not None
    joints = {joint.attrib["name"]: joint for joint in block.iterfind("joint")}
    assert set(joints) == {"wheel_left_joint", "wheel_right_joint"}
    for joint in joints.values():
        assert [one.attrib["name"] for one in joint.iterfind("state_interface")] == ["position", "velocity"]
        limits = {
            param.attrib["name"]: float(param.text or "nan")
            for param in joint.iterfind("command_interface/param")
        }
        speed = robot.motor.no_load_speed
        assert limits == {"min": pytest.approx(-speed), "max": pytest.approx(speed)}
    assert [float(one.text or 0) for one in block.iterfind("transmission/joint/mechanical_reduction")] == (
        [pytest.approx(robot.motor.gear_ratio)] * 2
    )


def test_a_name_with_xml_characters_is_escaped(robot: Robot) -> None:
    name = "a\"<b>&'c"
    strange = msgspec.structs.replace(robot, name=name)
    assert ET.fromstring(urdf(strange)).attrib["name"] == name
    assert ET.fromstring(mjcf(strange)).attrib["model"] == name


def test_casters_hang_clear_and_wheels_touch_at_the_track_width(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    for name in ("caster_front", "caster_back"):
        geom = model.geom(name)
        assert geom.pos[2] - geom.size[0] == pytest.approx(CASTER_GAP)
    left, right = model.body("wheel_left_link"), model.body("wheel_right_link")
    assert left.pos[1] - right.pos[1] == pytest.approx(robot.wheels.separation)
    assert left.pos[2] == pytest.approx(robot.wheel_radius)


def test_full_duty_reaches_the_specified_speed(robot: Robot) -> None:
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    for _ in range(2000):
        mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(max_wheel_speed(robot), rel=0.02)
    stall = model.actuator_forcerange[:, 1]
    assert (np.abs(data.actuator_force) < stall).all()


def test_a_small_motor_has_a_small_rotor(robot: Robot) -> None:
    """At half its speed at once: with a larger motor's rotor the board took a slow wheel for a reversed one."""
    model = mujoco.MjModel.from_xml_string(mjcf(robot))
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    while data.qvel[0] < max_wheel_speed(robot) / 2 and data.time < 1.0:
        mujoco.mj_step(model, data)
    grip_limited = max_wheel_speed(robot) / 2 / (robot.traction * GRAVITY)
    assert data.time < max(0.3, 1.2 * grip_limited)
