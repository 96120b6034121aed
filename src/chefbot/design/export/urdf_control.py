"""The parts of a URDF beyond the body: ros2_control's block, and Gazebo's extensions.

ros2_control:
https://control.ros.org/jazzy/doc/ros2_control/hardware_interface/doc/hardware_components_userdoc.html

Gazebo: http://sdformat.org/tutorials?tut=sdformat_urdf_extensions
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from chefbot.design.export.mjcf import BODY_FRICTION, CASTER_FRICTION
from chefbot.design.export.sdf_elements import add_value, add_values
from chefbot.design.export.sdf_sensors import WHEELS, gz_drive, gz_sensors
from chefbot.design.export.urdf_frames import joint_name
from chefbot.robot.geometry import layout
from chefbot.robot.spec import Robot

MOCK = "mock_components/GenericSystem"
"""ros2_control's simulated hardware, which reaches every command at once."""


def ros2_control(robot: Robot, prefix: str = "", hardware: str = MOCK) -> ET.Element:
    """Return the two wheels for diff_drive_controller and their gear.

    Velocity commands are within the motor's limits; the states are position and velocity; the transmission
    has the gear ratio (joint = motor / ratio).
    """
    block = ET.Element("ros2_control", name=f"{prefix}drive", type="system")
    add_value(ET.SubElement(block, "hardware"), "plugin", hardware)
    for wheel in WHEELS:
        joint = ET.SubElement(block, "joint", name=prefix + joint_name(wheel))
        command = ET.SubElement(joint, "command_interface", name="velocity")
        add_value(command, "param", -float(robot.motor.no_load_speed), name="min")
        add_value(command, "param", float(robot.motor.no_load_speed), name="max")
        for state in ("position", "velocity"):
            ET.SubElement(joint, "state_interface", name=state)
    for wheel in WHEELS:
        block.append(_transmission(robot, wheel, prefix))
    return block


def _transmission(robot: Robot, wheel: str, prefix: str) -> ET.Element:
    name = wheel.removesuffix("_link")
    element = ET.Element("transmission", name=f"{prefix}{name}_transmission")
    add_value(element, "plugin", "transmission_interface/SimpleTransmission")
    ET.SubElement(element, "actuator", name=f"{prefix}{name}_motor", role="actuator1")
    joint = ET.SubElement(element, "joint", name=prefix + joint_name(wheel), role="joint1")
    add_value(joint, "mechanical_reduction", float(robot.motor.gear_ratio))
    return element


def gazebo(robot: Robot, prefix: str = "") -> list[ET.Element]:
    """Return the friction of links in contact, the sensors and the drive."""
    blocks = [_friction(f"{prefix}{wheel}", robot.wheels.friction) for wheel in WHEELS]
    blocks += [
        _friction(f"{prefix}caster_{name}_link", CASTER_FRICTION) for name in layout.caster_positions(robot)
    ]
    blocks += [_friction(f"{prefix}{link}", BODY_FRICTION) for link in ("base_link", "payload_link")]
    for frame, sensor in gz_sensors(robot, prefix).items():
        block = ET.Element("gazebo", reference=f"{prefix}{frame}")
        block.append(sensor)
        blocks.append(block)
    drive = ET.Element("gazebo")
    drive.extend(gz_drive(robot, prefix))
    return [*blocks, drive]


def _friction(link: str, value: float) -> ET.Element:
    block = ET.Element("gazebo", reference=link)
    add_values(block, mu1=float(value), mu2=float(value))
    return block
