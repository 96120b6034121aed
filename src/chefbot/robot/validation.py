"""Checks for robots that could not be built or could not move; each error names the key to change."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from chefbot.errors import name_hint
from chefbot.robot.board import board_problems
from chefbot.robot.drivetrain import DRIVE_PROTOCOLS, DRIVER_INPUTS, ROS_BASE
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height
from chefbot.robot.geometry.mass import total_mass
from chefbot.robot.geometry.solids import payload, solids
from chefbot.robot.materials import MATERIALS
from chefbot.robot.motion_limits import max_wheel_speed
from chefbot.robot.section import Mount, MountingPosition
from chefbot.robot.sensors import (
    AUTO,
    COLOR_CAMERA_DRIVERS,
    DEPTH_CAMERA_DRIVERS,
    IMU_DRIVERS,
    LIDAR_DRIVERS,
    MAX_FIELD_OF_VIEW,
    MAX_IMAGE_PIXELS,
    Camera,
    ColorCamera,
)
from chefbot.robot.spec import Robot

MAX_LENS_RATIO = 1.5
"""Ratio of two focal lengths that should be equal from which one of them is wrong."""
Contradiction = tuple[bool, str, str]
"""Whether the contradiction is present; key of the robot file; message."""


def check_buildable(robot: Robot, where: str) -> None:
    """Raise RobotFileError for the first contradiction in a robot description."""
    check_geometry(robot, where)
    _raise_first(_drive(robot), where)


def check_geometry(robot: Robot, where: str) -> None:
    """Check everything that does not need the mass; a robot that passes has valid solids."""
    geometry = (_body, _materials, _wheels, _plates, _stack, _motors, _clamps)
    for contradictions in (*geometry, _sensors, _cameras, _names):
        _raise_first(contradictions(robot), where)


def _raise_first(contradictions: Iterator[Contradiction], where: str) -> None:
    for impossible, key, reason in contradictions:
        if impossible:
            raise RobotFileError(f"{where}: {key}: {reason}")


def mm(metres: float) -> str:
    """Format a length in millimetres, as on drawings."""
    return f"{1000 * metres:.4g} mm"


def _body(robot: Robot) -> Iterator[Contradiction]:
    body = robot.body
    rectangular = body.length is not None or body.width is not None
    yield (
        body.radius is None and not rectangular,
        "body",
        "'body.radius' is missing, or body.length and body.width",
    )
    both = body.radius is not None and (rectangular or body.axle_offset != 0.0)
    yield (
        both,
        "body.radius",
        "is that of a round body; body.length, width and axle_offset are of a rectangular one",
    )
    half = rectangular and (body.length is None or body.width is None)
    yield half, "body", "a rectangular body has both a length and a width"
    outside = rectangular and abs(body.axle_offset) >= (body.length or 0.0) / 2
    yield outside, "body.axle_offset", "the axle lies outside the body"


def _materials(robot: Robot) -> Iterator[Contradiction]:
    for section in ("plates", "poles", "tubes", "motor_clamp", "casters"):
        name = getattr(robot, section).material
        if name not in MATERIALS:
            yield True, f"{section}.material", f"unknown {name!r}{name_hint(name, MATERIALS)}"


def _plates(robot: Robot) -> Iterator[Contradiction]:
    plates, plate, inner = robot.plates, robot.body.plate, layout.notch_floor(robot)
    yield from _notch(robot)
    nothing_left = plates.centre_hole / 2 >= inner
    yield nothing_left, "plates.centre_hole", f"{mm(plates.centre_hole)} leaves nothing of the plate"
    reach = robot.poles.reach
    poles_outside = min(plate.room(reach, reach), plate.room(-reach, reach)) < robot.poles.radius
    yield poles_outside, "poles.reach", "the poles stand outside the plates"
    too_wide = plates.screw_hole >= 2 * robot.poles.radius
    yield too_wide, "plates.screw_hole", "is as wide as the poles that are screwed there"
    casters_outside = robot.casters.offset + robot.casters.radius > min(plate.front, plate.back)
    yield casters_outside, "casters.offset", "the casters stand outside the body"
    top = robot.plates.count
    for key, place in _places(robot):
        yield place.plate > top, f"{key}.plate", f"there is no plate {place.plate}, the highest is {top}"


def _notch(robot: Robot) -> Iterator[Contradiction]:
    plate, notch, inner = robot.body.plate, robot.plates.notch, layout.notch_floor(robot)
    if notch is not None:
        too_deep = f"is deeper than the {plate}; make it shallower"
        yield notch.depth >= plate.half_width, "plates.notch.depth", too_deep
        outside = min(plate.room(notch.length / 2, inner), plate.room(-notch.length / 2, inner)) <= 0.0
        yield outside, "plates.notch", f"lies outside the {plate}; make it deeper or shorter"


def _places(robot: Robot) -> Iterator[tuple[str, MountingPosition]]:
    yield "places.battery", robot.places.battery
    yield "places.driver", robot.places.driver
    for i, item in enumerate(robot.equipment):
        yield f"equipment[{i}].place", item.place


def _stack(robot: Robot) -> Iterator[Contradiction]:
    tubes, poles = robot.tubes, robot.poles
    yield 2 * poles.radius > tubes.bore, "tubes.bore", f"poles of {mm(2 * poles.radius)} do not go in"
    too_long = robot.plates.count > 1 and 2 * poles.height > tubes.length
    yield too_long, "poles.height", "two poles are longer than the tube that they hold"
    too_high = 2 * robot.casters.radius + layout.CASTER_GAP >= layout.plate_undersides(robot)[0]
    yield too_high, "casters.radius", "the balls are higher than the base plate"


def _motors(robot: Robot) -> Iterator[Contradiction]:
    motor, plate, available = robot.motor, 2 * robot.body.plate.half_width, layout.motor_front(robot)
    reason = f"{mm(motor.diameter)} is wider than the plate of {mm(plate)}"
    yield motor.diameter >= plate, "motor.diameter", reason
    room = f"between the wheels there are {mm(max(available, 0.0))} for each motor"
    yield motor.length >= available, "motor.length", f"{mm(motor.length)} does not fit: {room}"
    yield motor.shaft_diameter >= robot.wheels.diameter, "motor.shaft_diameter", "is as thick as the wheel"
    touches = layout.motor_bottom(robot) <= 0.0
    yield touches, "wheels.diameter", f"the motor of {mm(motor.diameter)} would touch the floor"
    idle_above_stall = motor.no_load_current >= motor.stall_current
    yield idle_above_stall, "motor.no_load_current", "is not below motor.stall_current"


def _clamps(robot: Robot) -> Iterator[Contradiction]:
    clamp, motor, screw = robot.motor_clamp, robot.motor, robot.plates.screw_hole
    hole = layout.SHAFT_CLEARANCE * motor.shaft_diameter
    yield hole >= clamp.width, "motor_clamp.width", "is narrower than the hole for the shaft"
    below = motor.diameter / 2 - motor.shaft_offset
    end = f"breaks out of the clamp, which ends {mm(below)} below the shaft"
    yield hole / 2 >= below, "motor.shaft_diameter", f"a hole of {mm(hole)} round the shaft {end}"
    across, along = layout.clamp_screws(robot)[0]
    yield 2.0 * across <= screw, "motor_clamp.width", f"screws need more than {mm(5.0 * screw)}"
    reason = f"{mm(clamp.length)} leaves no material round screws of {mm(screw)}"
    yield clamp.length / 2 - along <= screw / 2, "motor_clamp.length", reason
    yield clamp.thickness >= clamp.length, "motor_clamp.thickness", "is not below motor_clamp.length"


def _names(robot: Robot) -> Iterator[Contradiction]:
    """Check that names are unique: drawings, models and this check identify parts by name.

    The robot's name (root of its models) and its frames are included.
    """
    parts = (*solids(robot), payload(robot))
    names = Counter(part.name for part in parts)
    frames = {"base_footprint", *robot.sensors.by_frame, *(part.link for part in parts)}
    for i, item in enumerate(robot.equipment):
        duplicate = names[item.name] > 1 or item.name in frames
        yield duplicate, f"equipment[{i}].name", f"another part is called {item.name!r} too"
    yield robot.name in {*names, *frames}, "name", f"a part of the robot is called {robot.name!r} too"


def _wheels(robot: Robot) -> Iterator[Contradiction]:
    wheels, body, plate = robot.wheels, robot.body, robot.body.plate
    too_high = body.clearance >= wheels.diameter
    yield too_high, "body.clearance", f"{mm(body.clearance)} is above the wheels' top"
    yield wheels.separation <= wheels.width, "wheels.separation", "the wheels overlap each other"
    larger = "body.radius" if body.radius is not None else "body.width"
    reason = f"the wheels stand clear of the {plate}; make it smaller or {larger} larger"
    yield wheels.inner_face > plate.half_width + wheels.width, "wheels.separation", reason
    too_tall = robot.wheel_radius > body_height(robot)
    yield too_tall, "wheels.diameter", "the wheels are taller than twice the body"


def _drive(robot: Robot) -> Iterator[Contradiction]:
    reason = f"{robot.motor.stall_torque:.3g} N m per wheel cannot roll {total_mass(robot):.3g} kg at all"
    yield max_wheel_speed(robot) <= 0.0, "motor.stall_torque", reason
    braking = robot.drive.max_deceleration
    too_soft = braking is not None and braking < robot.drive.max_acceleration
    yield (
        too_soft,
        "drive.max_deceleration",
        "is below drive.max_acceleration, which planned braking counts on",
    )
    yield from _battery_and_driver(robot)
    protocol = robot.drive.protocol
    unknown = f"unknown {protocol!r}{name_hint(protocol, (*DRIVE_PROTOCOLS, ROS_BASE))}"
    yield protocol not in ("", *DRIVE_PROTOCOLS, ROS_BASE), "drive.protocol", unknown
    unneeded = robot.drive.command_timeout is not None and protocol != ROS_BASE
    yield unneeded, "drive.command_timeout", f"is for a drive of protocol {ROS_BASE} only"
    yield from board_problems(robot.board, _unused_signals(robot))


def _battery_and_driver(robot: Robot) -> Iterator[Contradiction]:
    battery = robot.battery
    yield battery.empty_voltage >= battery.voltage, "battery.empty_voltage", "is not below battery.voltage"
    yield battery.voltage > battery.full_voltage, "battery.voltage", "is above battery.full_voltage"
    driver = robot.driver
    yield driver.voltage_min >= driver.voltage_max, "driver.voltage_min", "is not below driver.voltage_max"
    unknown = f"unknown {driver.inputs!r}{name_hint(driver.inputs, DRIVER_INPUTS)}"
    yield driver.inputs not in DRIVER_INPUTS, "driver.inputs", unknown
    no_enable = driver.enable_diag and not driver.enable
    yield no_enable, "driver.enable_diag", "is the enable input of a driver whose driver.enable is false"


def _unused_signals(robot: Robot) -> set[str]:
    """Return the signals of the motor board that this robot does not need; their pins are inputs, or not set up."""
    unused = set() if robot.sensors.cliff_sensors else {"cliff_0"}
    return unused | ({"pwm_left", "pwm_right"} if robot.driver.inputs == "two_pwm" else set())


def _cameras(robot: Robot) -> Iterator[Contradiction]:
    depth, color = robot.sensors.depth_camera, robot.sensors.color_camera
    if depth is not None:
        identity = "serial" if depth.serial != AUTO else ""
        yield from _camera(depth, "sensors.depth_camera", depth.driver, DEPTH_CAMERA_DRIVERS, identity)
    if color is not None:
        key = "sensors.color_camera"
        identity = "device" if color.device != AUTO else ""
        yield from _camera(color, key, color.driver, COLOR_CAMERA_DRIVERS, identity)
        lens = color.intrinsics
        reason = "lies outside the image: the calibration is that of another size"
        yield lens.cx > color.width - 1, f"{key}.lens.cx", reason
        yield lens.cy > color.height - 1, f"{key}.lens.cy", reason
        view = 2.0 * math.atan(color.width / 2.0 / lens.fx)
        differs = not 1.0 / MAX_LENS_RATIO < lens.fx / color.focal_length_px < MAX_LENS_RATIO
        seen = f"shows {math.degrees(view):.0f} degrees, but field_of_view is {math.degrees(color.field_of_view):.0f}"
        yield differs, f"{key}.lens.fx", seen
        no_square = not 1.0 / MAX_LENS_RATIO < lens.fy / lens.fx < MAX_LENS_RATIO
        yield no_square, f"{key}.lens.fy", "is far from fx: pixels are nearly square"


def _camera(
    camera: Camera, key: str, driver: str, drivers: tuple[str, ...], identity: str
) -> Iterator[Contradiction]:
    """Check a camera's image and its driver; identity: key that names one of several such cameras, if it is given."""
    too_wide = camera.field_of_view > MAX_FIELD_OF_VIEW
    yield too_wide, f"{key}.field_of_view", "above 149 degrees is not a camera"
    yield camera.width * camera.height > MAX_IMAGE_PIXELS, f"{key}.width", "above 4 megapixels"
    unknown = f"unknown {driver!r}{name_hint(driver, drivers)}"
    yield driver not in ("", *drivers), f"{key}.driver", unknown
    yield bool(identity) and not driver, f"{key}.driver", f"is missing beside {key}.{identity}"


def _sensors(robot: Robot) -> Iterator[Contradiction]:
    sensors = robot.sensors
    for name in ("depth_camera", "color_camera", "lidar", "ultrasonic"):
        sensor, key = getattr(sensors, name), f"sensors.{name}"
        if sensor is None:
            continue
        if not isinstance(sensor, ColorCamera):
            yield sensor.range_min >= sensor.range_max, f"{key}.range_min", "is not below range_max"
        outside = _outside_footprint(robot, sensor.mount)
        yield outside, f"{key}.mount", "sits outside the body"
        outside = not 0 < sensor.mount.z <= body_height(robot)
        yield outside, f"{key}.mount.z", "is not between floor and top"
    for i, cliff in enumerate(sensors.cliff_sensors.values()):
        outside = _outside_footprint(robot, cliff.mount)
        yield outside, f"sensors.cliffs.positions[{i}]", "sits outside the body"
    if sensors.cliffs is not None:
        too_short = sensors.cliffs.range <= sensors.cliffs.height
        yield too_short, "sensors.cliffs.range", "does not reach the floor from sensors.cliffs.height"
    lidar = sensors.lidar
    if lidar is not None:
        unknown = f"unknown {lidar.driver!r}{name_hint(lidar.driver, LIDAR_DRIVERS)}"
        yield lidar.driver not in ("", *LIDAR_DRIVERS), "sensors.lidar.driver", unknown
        yield (
            lidar.port != AUTO and not lidar.driver,
            "sensors.lidar.driver",
            "is missing beside sensors.lidar.port",
        )
    imu = sensors.imu
    unknown = f"unknown {imu.driver!r}{name_hint(imu.driver, IMU_DRIVERS)}"
    yield imu.driver not in ("", *IMU_DRIVERS), "sensors.imu.driver", unknown
    yield imu.port != AUTO and not imu.driver, "sensors.imu.driver", "is missing beside sensors.imu.port"
    blind = sensors.depth_camera is None and lidar is None
    yield blind, "sensors", "neither depth_camera nor lidar: the robot could not see"


def _outside_footprint(robot: Robot, mount: Mount) -> bool:
    if robot.footprint.corners:
        xs, ys = zip(*robot.footprint.corners, strict=True)
        return not (min(xs) <= mount.x <= max(xs) and min(ys) <= mount.y <= max(ys))
    return math.hypot(mount.x, mount.y) > robot.circumscribed_radius
