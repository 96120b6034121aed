"""The robot's sensors and drive as Gazebo simulates them (gz-sim 8, Harmonic), for SDF and for URDF.

Systems and their parameters: https://gazebosim.org/api/sim/8/namespace_gz_1_1sim_1_1systems.html;
sensors: http://sdformat.org/spec?ver=1.9&elem=sensor.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

from chefbot.design.export.sdf_elements import add_value, add_values
from chefbot.design.export.urdf_frames import COLOR_OPTICAL_FRAME, OPTICAL_FRAME, joint_name
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.robot.sensors import Camera, CliffSensor, ColorCamera, DepthCamera, ImuSpec, Lidar, Ultrasonic
from chefbot.robot.spec import Robot

PICTURE_NEAR_CLIP, PICTURE_FAR_CLIP = 0.05, 100.0
"""Near clip of a colour image, m, below the minimum depth, and far clip of a colour camera."""
CLIFF_MIN_RANGE = 0.002
"""Minimum range of a simulated cliff sensor, m."""
CONE_STEP = math.radians(2.0)
"""Angle between the rays of an ultrasonic cone: finer than a chair leg of 3.5 cm at one metre."""
AnySensor = ImuSpec | Ultrasonic | CliffSensor | DepthCamera | ColorCamera | Lidar
WHEELS = ("wheel_left_link", "wheel_right_link")


def gz_sensors(robot: Robot, prefix: str = "") -> dict[str, ET.Element]:
    """Return frame to <sensor> with the robot's rates, ranges and noise, and chefbot's topics."""
    return {frame: _sensor(frame, sensor, prefix) for frame, sensor in robot.sensors.by_frame.items()}


def _sensor(frame: str, sensor: AnySensor, prefix: str) -> ET.Element:
    kind, topic, add_details = KINDS[type(sensor)]
    element = ET.Element("sensor", name=f"{prefix}{frame.removesuffix('_link')}", type=kind)
    add_values(element, always_on=True, update_rate=float(sensor.rate), topic=topic)
    # The frame that messages name; without it Gazebo makes one up of model, link and sensor.
    add_value(element, "gz_frame_id", f"{prefix}{frame}")
    add_details(element, sensor, prefix)
    return element


def _imu(element: ET.Element, sensor: ImuSpec, _prefix: str) -> None:
    imu = ET.SubElement(element, "imu")
    for quantity, deviation, offset in (
        ("angular_velocity", sensor.gyro_noise, sensor.gyro_bias),
        ("linear_acceleration", sensor.accelerometer_noise, 0.0),
    ):
        axes = ET.SubElement(imu, quantity)
        for axis in ("x", "y", "z"):
            noise = ET.SubElement(ET.SubElement(axes, axis), "noise", type="gaussian")
            add_values(noise, mean=0.0, stddev=float(deviation), bias_mean=0.0, bias_stddev=float(offset))


def _camera(element: ET.Element, sensor: DepthCamera, prefix: str) -> None:
    """The noise of depth grows with its square, which SDF cannot describe: Gazebo's depth is exact."""
    camera = _picture(element, sensor)
    _clip(camera, min(PICTURE_NEAR_CLIP, sensor.range_min), sensor.range_max)
    _clip(ET.SubElement(camera, "depth_camera"), sensor.range_min, sensor.range_max)
    add_value(camera, "optical_frame_id", f"{prefix}{OPTICAL_FRAME}")


def _color_camera(element: ET.Element, sensor: ColorCamera, prefix: str) -> None:
    """Gazebo's picture is that of an ideal lens: the calibration of the robot file is not described."""
    camera = _picture(element, sensor)
    _clip(camera, PICTURE_NEAR_CLIP, PICTURE_FAR_CLIP)
    add_value(camera, "optical_frame_id", f"{prefix}{COLOR_OPTICAL_FRAME}")


def _picture(element: ET.Element, sensor: Camera) -> ET.Element:
    """Add and return <camera> with the field of view and the size of the picture."""
    camera = ET.SubElement(element, "camera")
    add_value(camera, "horizontal_fov", float(sensor.field_of_view))
    image = ET.SubElement(camera, "image")
    add_values(image, width=sensor.width, height=sensor.height, format="R8G8B8")
    return camera


def _clip(parent: ET.Element, near: float, far: float) -> None:
    add_values(ET.SubElement(parent, "clip"), near=float(near), far=float(far))


def _lidar(element: ET.Element, sensor: Lidar, _prefix: str) -> None:
    """The last beam of a full turn is one step before the first."""
    lidar = _rays(element, sensor, sensor.beams, ("horizontal",), sensor.angle_min, sensor.angle_max)
    if sensor.noise > 0.0:
        noise = ET.SubElement(lidar, "noise")
        add_values(noise, type="gaussian", mean=0.0, stddev=float(sensor.noise))


def _cone(element: ET.Element, sensor: Ultrasonic, _prefix: str) -> None:
    """Gazebo has no sonar: rays over the cone, of which the nearest is the range."""
    half = sensor.field_of_view / 2.0
    rays = 2 * max(1, round(half / CONE_STEP)) + 1
    _rays(element, sensor, rays, ("horizontal", "vertical"), -half, half)


def _beam(element: ET.Element, sensor: CliffSensor, _prefix: str) -> None:
    """A single ray up to the range: a finite reading is floor."""
    lidar = ET.SubElement(element, "lidar")
    scan = ET.SubElement(lidar, "scan")
    add_values(ET.SubElement(scan, "horizontal"), samples=1, resolution=1, min_angle=0.0, max_angle=0.0)
    add_values(ET.SubElement(lidar, "range"), min=CLIFF_MIN_RANGE, max=float(sensor.range_max))


def _rays(
    element: ET.Element,
    sensor: Lidar | Ultrasonic,
    count: int,
    fans: tuple[str, ...],
    low: float,
    high: float,
) -> ET.Element:
    lidar = ET.SubElement(element, "lidar")
    scan = ET.SubElement(lidar, "scan")
    for fan in fans:
        add_values(ET.SubElement(scan, fan), samples=count, resolution=1, min_angle=low, max_angle=high)
    add_values(ET.SubElement(lidar, "range"), min=float(sensor.range_min), max=float(sensor.range_max))
    return lidar


KINDS: dict[type, tuple[str, str, Callable[[ET.Element, Any, str], None]]] = {
    ImuSpec: ("imu", "imu/data", _imu),
    DepthCamera: ("rgbd_camera", "camera", _camera),
    ColorCamera: ("camera", "color_camera/image", _color_camera),
    Lidar: ("gpu_lidar", "scan", _lidar),
    Ultrasonic: ("gpu_lidar", "ultrasonic", _cone),
    CliffSensor: ("gpu_lidar", "cliff", _beam),
}
"""Gazebo's sensor type, chefbot's topic, and the function that adds the rest."""


def gz_drive(robot: Robot, prefix: str = "") -> list[ET.Element]:
    """Return the model's systems for the differential drive and the joint states."""
    drive = plugin("gz-sim-diff-drive-system", "gz::sim::systems::DiffDrive")
    joints = [f"{prefix}{joint_name(wheel)}" for wheel in WHEELS]
    add_values(drive, left_joint=joints[0], right_joint=joints[1])
    add_values(drive, wheel_separation=float(robot.wheels.separation), wheel_radius=robot.wheel_radius)
    for quantity, maximum in (
        ("linear_velocity", max_speed(robot)),
        ("angular_velocity", max_turn(robot)),
        ("linear_acceleration", max_acceleration(robot)),
        ("angular_acceleration", max_turn_acceleration(robot)),
    ):
        add_value(drive, f"max_{quantity}", float(maximum))
        add_value(drive, f"min_{quantity}", -float(maximum))
    add_value(drive, "odom_publish_frequency", float(robot.sensors.imu.rate))
    add_values(drive, topic="cmd_vel", odom_topic="odom", tf_topic="tf")
    add_values(drive, frame_id=f"{prefix}odom", child_frame_id=f"{prefix}base_footprint")
    return [drive, _joint_states(joints)]


def _joint_states(joints: list[str]) -> ET.Element:
    states = plugin("gz-sim-joint-state-publisher-system", "gz::sim::systems::JointStatePublisher")
    add_value(states, "topic", "joint_states")
    for joint in joints:
        add_value(states, "joint_name", joint)
    return states


def plugin(filename: str, name: str) -> ET.Element:
    """Return the element of a gz-sim system."""
    return ET.Element("plugin", filename=filename, name=name)
