"""The SDF of every built-in robot, as Gazebo's own library reads it."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import msgspec
import mujoco
import numpy as np
import pytest
from tests.design.bodies import Body, assert_same, of_solids, tensor
from tests.design.sdf_checker import read_by_libsdformat

from chefbot.design.export.links import links
from chefbot.design.export.mjcf import CASTER_FRICTION, mjcf
from chefbot.design.export.sdf import sdf
from chefbot.design.export.sdf_sensors import CONE_STEP, gz_sensors
from chefbot.design.export.urdf import urdf
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.motion_limits import max_speed, max_turn
from chefbot.robot.spec import Robot


@pytest.fixture(params=sorted(built_in_robots()))
def robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def read_models(text: str, tmp_path: Path) -> dict[str, Any]:
    """What libsdformat reads; it must have no complaint."""
    file = tmp_path / "it.sdf"
    file.write_text(text)
    return read_by_libsdformat(file)


def number(element: ET.Element, path: str) -> float:
    """The one number at a path."""
    (found,) = element.iterfind(path)
    return float(found.text or "nan")


@pytest.mark.slow
def test_libsdformat_reads_the_same_masses_and_frames(robot: Robot, tmp_path: Path) -> None:
    model = read_models(sdf(robot), tmp_path)[robot.name]
    found = {
        name: Body(values[0], np.array(values[1:4]), tensor(*values[4:10]))
        for name, values in model["links"].items()
    }
    assert_same(found, of_solids(robot))
    for link in links(robot):
        assert model["links"][link.name][10:] == pytest.approx(link.at, abs=1e-8)
    compiled = mujoco.MjModel.from_xml_string(mjcf(robot))
    for frame in robot.sensors.by_frame:
        at, turn = model["frames"][frame][:3], np.array(model["frames"][frame][3:])
        site = compiled.site(frame)
        assert at == pytest.approx(site.pos, abs=1e-8)
        assert abs(turn @ site.quat) == pytest.approx(1.0, abs=1e-12)
    assert len(model["collisions"]) == sum(len(link.hulls) for link in links(robot))
    assert not model["static"]


@pytest.mark.rotated("exported packages and worlds")
@pytest.mark.slow
def test_sdf_equals_the_conversion_of_the_urdf_by_gazebo(robot: Robot, tmp_path: Path) -> None:
    """Its reader joins what is fixed to one link, with all masses, sensors and frictions."""
    file = tmp_path / "it.urdf"
    file.write_text(urdf(robot))
    theirs, ours = read_by_libsdformat(file)[robot.name], read_models(sdf(robot), tmp_path)[robot.name]
    for model in (theirs, ours):
        masses = [values[0] for values in model["links"].values()]
        assert sum(masses) == pytest.approx(total_mass(robot), rel=1e-8)
    assert theirs["sensors"].keys() == ours["sensors"].keys()
    for name, at in ours["sensors"].items():
        assert theirs["sensors"][name] == pytest.approx(at, abs=1e-8)
    assert sorted(theirs["collisions"].values()) == pytest.approx(sorted(ours["collisions"].values()))
    casters = [mu for name, mu in theirs["collisions"].items() if "__caster_" in name]
    assert casters == [pytest.approx(CASTER_FRICTION)] * 2


def test_drive_sensors_and_friction_follow_the_robot(robot: Robot) -> None:
    model = ET.fromstring(sdf(robot)).find("model")
    assert model is not None
    drive = model.find("plugin[@filename='gz-sim-diff-drive-system']")
    assert drive is not None
    assert number(drive, "wheel_separation") == pytest.approx(robot.wheels.separation)
    assert number(drive, "wheel_radius") == pytest.approx(robot.wheel_radius)
    assert number(drive, "max_linear_velocity") == pytest.approx(max_speed(robot), rel=1e-8)
    assert number(drive, "min_angular_velocity") == pytest.approx(-max_turn(robot), rel=1e-8)
    joints = {joint.attrib["name"] for joint in model.iterfind("joint[@type='revolute']")}
    assert {drive.findtext("left_joint"), drive.findtext("right_joint")} == joints
    grips = {
        solid.attrib["name"]: number(solid, "surface/friction/ode/mu")
        for solid in model.iterfind("link/collision")
    }
    assert grips["wheel_left"] == grips["wheel_right"] == pytest.approx(robot.wheels.friction)
    assert grips["caster_front"] < grips["hull"] < grips["wheel_left"]
    sensors = {sensor.attrib["name"]: sensor for sensor in model.iterfind("link/sensor")}
    assert set(sensors) == {frame.removesuffix("_link") for frame in robot.sensors.by_frame}
    for frame, sensor in robot.sensors.by_frame.items():
        element = sensors[frame.removesuffix("_link")]
        assert number(element, "update_rate") == pytest.approx(sensor.rate)
        pose = element.find("pose")
        assert pose is not None and pose.attrib["relative_to"] == frame
    imu = robot.sensors.imu
    assert number(sensors["imu"], "imu/angular_velocity/z/noise/stddev") == pytest.approx(
        imu.gyro_noise, rel=1e-8
    )


def test_lidar_beams_are_a_full_turn_without_a_duplicate() -> None:
    lidar = load_robot("chefbot_lidar").sensors.lidar
    assert lidar is not None
    element = gz_sensors(load_robot("chefbot_lidar"))["laser"]
    low, high = (number(element, f"lidar/scan/horizontal/{end}_angle") for end in ("min", "max"))
    step = (high - low) / (number(element, "lidar/scan/horizontal/samples") - 1)
    assert step * lidar.beams == pytest.approx(2 * np.pi, abs=1e-6)


def test_ultrasonic_beams_leave_no_gap_for_a_chair_leg() -> None:
    robot = load_robot("chefbot")
    sensor = robot.sensors.ultrasonic
    assert sensor is not None
    fan = gz_sensors(robot)["ultrasonic_link"].find("lidar/scan/horizontal")
    assert fan is not None
    width = number(fan, "max_angle") - number(fan, "min_angle")
    assert width == pytest.approx(sensor.field_of_view, rel=1e-8)
    assert width / (number(fan, "samples") - 1) <= 1.5 * CONE_STEP


def test_a_name_with_xml_characters_is_escaped(tmp_path: Path) -> None:
    name = "a\"<b>&'c"
    strange = msgspec.structs.replace(load_robot("chefbot"), name=name)
    model = ET.fromstring(sdf(strange)).find("model")
    assert model is not None and model.attrib["name"] == name
