"""The robot's sensors and drive as Gazebo simulates them (gz-sim 8, Harmonic), for SDF and for URDF.

Systems and their parameters: https://gazebosim.org/api/sim/8/namespace_gz_1_1sim_1_1systems.html;
sensors: http://sdformat.org/spec?ver=1.9&elem=sensor.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

from chefbot.design.export.sdf_elements import add_value
from chefbot.design.export.urdf_frames import OPTICAL_FRAME, joint_name
from chefbot.robot.motion_limits import max_acceleration, max_speed, max_turn, max_turn_acceleration
from chefbot.robot.sensors import DepthCamera, ImuSpec, Lidar, Ultrasonic
from chefbot.robot.spec import Robot

PICTURE_NEAR = 0.05
"""Near clip of the colour image, m, below the minimum depth."""
CONE_STEP = math.radians(2.0)
"""Angle between the rays of an ultrasonic cone: finer than a chair leg of 3.5 cm at one metre."""
WHEELS = ("wheel_left_link", "wheel_right_link")


def gz_sensors(robot: Robot, prefix: str = "") -> dict[str, ET.Element]:
    """Return frame to <sensor> with the robot's rates, ranges and noise, and chefbot's topics."""
    return {frame: _sensor(frame, sensor, prefix) for frame, sensor in robot.sensors.by_frame.items()}


def _sensor(frame: str, sensor: ImuSpec | Ultrasonic | DepthCamera | Lidar, prefix: str) -> ET.Element:
    kind, topic = _kind(sensor)
    element = ET.Element("sensor", name=f"{prefix}{frame.removesuffix('_link')}", type=kind)
    add_value(element, "always_on", True)
    add_value(element, "update_rate", float(sensor.rate))
    add_value(element, "topic", topic)
    # The frame that messages name; without it Gazebo makes one up of model, link and sensor.
    add_value(element, "gz_frame_id", f"{prefix}{frame}")
    if isinstance(sensor, ImuSpec):
        _imu(element, sensor)
    elif isinstance(sensor, DepthCamera):
        _camera(element, sensor, prefix)
    elif isinstance(sensor, Lidar):
        _lidar(element, sensor)
    else:
        _cone(element, sensor)
    return element


def _kind(sensor: ImuSpec | Ultrasonic | DepthCamera | Lidar) -> tuple[str, str]:
    """Gazebo's sensor type and chefbot's topic."""
    if isinstance(sensor, ImuSpec):
        return "imu", "imu/data"
    if isinstance(sensor, DepthCamera):
        return "rgbd_camera", "camera"
    return "gpu_lidar", "scan" if isinstance(sensor, Lidar) else "ultrasonic"


def _imu(element: ET.Element, sensor: ImuSpec) -> None:
    imu = ET.SubElement(element, "imu")
    for quantity, deviation, offset in (
        ("angular_velocity", sensor.gyro_noise, sensor.gyro_bias),
        ("linear_acceleration", sensor.accelerometer_noise, 0.0),
    ):
        axes = ET.SubElement(imu, quantity)
        for axis in ("x", "y", "z"):
            noise = _noise(ET.SubElement(axes, axis), deviation)
            noise.set("type", "gaussian")
            add_value(noise, "bias_mean", 0.0)
            add_value(noise, "bias_stddev", float(offset))


def _noise(parent: ET.Element, deviation: float) -> ET.Element:
    noise = ET.SubElement(parent, "noise")
    add_value(noise, "mean", 0.0)
    add_value(noise, "stddev", float(deviation))
    return noise


def _camera(element: ET.Element, sensor: DepthCamera, prefix: str) -> None:
    """The noise of depth grows with its square, which SDF cannot describe: Gazebo's depth is exact."""
    camera = ET.SubElement(element, "camera")
    add_value(camera, "horizontal_fov", float(sensor.field_of_view))
    image = ET.SubElement(camera, "image")
    add_value(image, "width", sensor.width)
    add_value(image, "height", sensor.height)
    add_value(image, "format", "R8G8B8")
    _clip(camera, min(PICTURE_NEAR, sensor.range_min), sensor.range_max)
    _clip(ET.SubElement(camera, "depth_camera"), sensor.range_min, sensor.range_max)
    add_value(camera, "optical_frame_id", f"{prefix}{OPTICAL_FRAME}")


def _clip(parent: ET.Element, near: float, far: float) -> None:
    clip = ET.SubElement(parent, "clip")
    add_value(clip, "near", float(near))
    add_value(clip, "far", float(far))


def _lidar(element: ET.Element, sensor: Lidar) -> None:
    """A full turn; the last beam is one step before the first."""
    lidar = ET.SubElement(element, "lidar")
    scan = ET.SubElement(lidar, "scan")
    _fan(scan, "horizontal", sensor.beams, -math.pi, math.pi - 2.0 * math.pi / sensor.beams)
    _range(lidar, sensor.range_min, sensor.range_max)
    if sensor.noise > 0.0:
        noise = ET.SubElement(lidar, "noise")
        add_value(noise, "type", "gaussian")
        add_value(noise, "mean", 0.0)
        add_value(noise, "stddev", float(sensor.noise))


def _cone(element: ET.Element, sensor: Ultrasonic) -> None:
    """Gazebo has no sonar: rays over the cone, of which the nearest is the range."""
    lidar = ET.SubElement(element, "lidar")
    scan = ET.SubElement(lidar, "scan")
    half = sensor.field_of_view / 2.0
    rays = 2 * max(1, round(half / CONE_STEP)) + 1
    for direction in ("horizontal", "vertical"):
        _fan(scan, direction, rays, -half, half)
    _range(lidar, sensor.range_min, sensor.range_max)


def _fan(scan: ET.Element, direction: str, count: int, low: float, high: float) -> None:
    fan = ET.SubElement(scan, direction)
    add_value(fan, "samples", count)
    add_value(fan, "resolution", 1)
    add_value(fan, "min_angle", low)
    add_value(fan, "max_angle", high)


def _range(lidar: ET.Element, low: float, high: float) -> None:
    limits = ET.SubElement(lidar, "range")
    add_value(limits, "min", float(low))
    add_value(limits, "max", float(high))


def gz_drive(robot: Robot, prefix: str = "") -> list[ET.Element]:
    """Return the model's systems for the differential drive and the joint states."""
    drive = plugin("gz-sim-diff-drive-system", "gz::sim::systems::DiffDrive")
    joints = [f"{prefix}{joint_name(wheel)}" for wheel in WHEELS]
    for tag, joint in zip(("left_joint", "right_joint"), joints, strict=True):
        add_value(drive, tag, joint)
    add_value(drive, "wheel_separation", float(robot.wheels.separation))
    add_value(drive, "wheel_radius", robot.wheel_radius)
    for quantity, maximum in (
        ("linear_velocity", max_speed(robot)),
        ("angular_velocity", max_turn(robot)),
        ("linear_acceleration", max_acceleration(robot)),
        ("angular_acceleration", max_turn_acceleration(robot)),
    ):
        add_value(drive, f"max_{quantity}", float(maximum))
        add_value(drive, f"min_{quantity}", -float(maximum))
    add_value(drive, "odom_publish_frequency", float(robot.sensors.imu.rate))
    for tag, value in (("topic", "cmd_vel"), ("odom_topic", "odom"), ("tf_topic", "tf")):
        add_value(drive, tag, value)
    add_value(drive, "frame_id", f"{prefix}odom")
    add_value(drive, "child_frame_id", f"{prefix}base_footprint")
    states = plugin("gz-sim-joint-state-publisher-system", "gz::sim::systems::JointStatePublisher")
    add_value(states, "topic", "joint_states")
    for joint in joints:
        add_value(states, "joint_name", joint)
    return [drive, states]


def plugin(filename: str, name: str) -> ET.Element:
    """Return the element of a gz-sim system."""
    return ET.Element("plugin", filename=filename, name=name)
