"""The devices of a built robot for `chefbot doctor`: their drivers run for a while, and no motion is commanded."""

from __future__ import annotations

import re
import time
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

from rich.console import Console

from chefbot.devices.cameras.camera_device import CameraDevice
from chefbot.devices.cameras.color_camera import ColorCameraDevice
from chefbot.devices.cameras.depth_camera import DepthCameraDevice
from chefbot.devices.motor_board import MotorBoardDevice
from chefbot.devices.serial_connection import is_missing_path
from chefbot.devices.serial_imu import SerialImuDevice
from chefbot.devices.serial_lidar import SerialLidarDevice
from chefbot.errors import ChefbotError, UserError
from chefbot.msgs.diagnostic_msgs import OK, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.sensor_msgs import BatteryState
from chefbot.robot.drivetrain import ROS_BASE
from chefbot.robot.load import load_robot
from chefbot.robot.sensors import AUTO
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.clock import WallClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Device
from chefbot.runtime.node_container import NodeContainer

SECONDS = 12.0
"""Time for which the drivers run: a Mega with its boot loader may take 6 s to answer."""
OBSERVATION_TIME = 3.0
"""Time for which each device is observed, s."""
TICK_RATE, DRIVE_RATE = 50.0, 20.0
"""Rates of tick messages, Hz: of the motor board, and the least of a motor drive, which is polled."""
BOARD = "board"
TOPICS_WITHOUT_DRIVER = {
    "lidar": "/scan",
    "depth_camera": "/camera/depth/image_raw",
    "color_camera": "/camera/color/image_raw",
}
"""Sensor to the topic on which its data are expected if the robot file names no driver."""
MIN_SHARE = 0.7
"""Share of its rate below which a stream is a problem."""
console = Console(highlight=False, soft_wrap=True, markup=False)


class Stream(NamedTuple):
    """A topic that a device publishes, in words, and its rate, Hz."""

    topic: str
    title: str
    rate: float


class BuiltDevice(NamedTuple):
    """A device of the robot: its driver, the name of its diagnostics, and its streams."""

    kind: type[Device]
    title: str
    status: str
    streams: tuple[Stream, ...]


class Observations:
    """What the drivers have published: statuses by name, times of reception by topic, and faults by node."""

    def __init__(self) -> None:
        self.statuses: dict[str, DiagnosticStatus] = {}
        self.times: dict[str, list[float]] = {}
        self.faults: dict[str, str] = {}
        self.battery: BatteryState | None = None

    def add(self, publication: Publication) -> None:
        """Remember a message with its time of reception."""
        message = publication.message
        self.times.setdefault(publication.topic, []).append(time.monotonic())
        if isinstance(message, DiagnosticArray):
            self.statuses.update((status.name, status) for status in message.status)
        if isinstance(message, BatteryState):
            self.battery = message

    def add_fault(self, fault: Fault) -> None:
        """Remember why a driver has given up."""
        self.faults[re.split(r"[ .]", fault.callback)[0]] = str(fault.error)

    def is_measured(self, topic: str) -> bool:
        """Return whether a topic has been received for long enough."""
        times = self.times.get(topic, [])
        return len(times) > 1 and times[-1] - times[0] >= OBSERVATION_TIME

    def rate(self, topic: str) -> float:
        """Return the mean rate of a topic since its first message, Hz; 0 with less than two."""
        times = self.times.get(topic, [])
        return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0


def devices_of(robot: Robot) -> list[BuiltDevice]:
    """Return the devices of a robot that have a driver here."""
    sensors = robot.sensors
    imu = Stream("imu/data", "IMU", sensors.imu.rate)
    devices = []
    if robot.drive.protocol != ROS_BASE:
        devices.append(BuiltDevice(MotorBoardDevice, BOARD, "board", tuple(_board_streams(robot, imu))))
    if sensors.imu.driver:
        devices.append(BuiltDevice(SerialImuDevice, "imu", "IMU", (imu,)))
    if sensors.lidar is not None and sensors.lidar.driver:
        scans = Stream("scan", "scans", sensors.lidar.rate)
        devices.append(BuiltDevice(SerialLidarDevice, "lidar", "lidar", (scans,)))
    if sensors.depth_camera is not None and sensors.depth_camera.driver:
        images = Stream("camera/depth/image_raw", "images", sensors.depth_camera.rate)
        devices.append(BuiltDevice(DepthCameraDevice, "depth_camera", "depth camera", (images,)))
    if sensors.color_camera is not None and sensors.color_camera.driver:
        pictures = Stream("camera/color/image_raw", "pictures", sensors.color_camera.rate)
        devices.append(BuiltDevice(ColorCameraDevice, "color_camera", "colour camera", (pictures,)))
    return devices


def _board_streams(robot: Robot, imu: Stream) -> Iterator[Stream]:
    """Yield the streams of the motor board, or of the motor drive in its place."""
    yield Stream("wheel_ticks", "wheel ticks", DRIVE_RATE if robot.drive.protocol else TICK_RATE)
    if robot.drive.protocol:
        return
    if not robot.sensors.imu.driver:
        yield imu
    if robot.sensors.ultrasonic is not None:
        yield Stream("ultrasonic", "ultrasonic", robot.sensors.ultrasonic.rate)


def built_lines(robot_file: str, ports: Mapping[str, str], seconds: float = SECONDS) -> list[str]:
    """Run the drivers of a robot's devices and return what each one does; "! " begins a problem.

    ports: ports of board, imu and lidar that replace those of the robot file. Raises RobotFileError, and UserError
    for a port that two devices have.
    """
    robot = load_robot(robot_file)
    devices = devices_of(robot)
    console.print(
        f"devices of {robot.name}: their drivers run for {seconds:.0f} s; the wheels are not driven."
    )
    ports = {device.title: ports.get(device.title) or _port_of(robot, device) for device in devices}
    _check_distinct(ports)
    missing = [device for device in devices if is_missing_path(ports[device.title])]
    present = [device for device in devices if device not in missing]
    seen = _observe(robot, present, ports, seconds)
    return [
        *(
            f"! {device.status}: its port {ports[device.title]} does not exist; plug it in"
            for device in missing
        ),
        *(line for device in present for line in _lines(device, seen)),
        *_unused(robot),
    ]


def _check_distinct(ports: Mapping[str, str]) -> None:
    """Raise UserError if two devices have the same port."""
    given = {title: port for title, port in ports.items() if port != AUTO}
    for (title, port), (other, same) in combinations(given.items(), 2):
        if port == same:
            raise UserError(f"{title} and {other} have the same port, {port}; each device has its own")


def _port_of(robot: Robot, device: BuiltDevice) -> str:
    """Return the port that the robot file gives to a device; auto without one."""
    sensor = {"imu": robot.sensors.imu, "lidar": robot.sensors.lidar}.get(device.title)
    return AUTO if sensor is None else sensor.port


def _observe(
    robot: Robot, devices: Iterable[BuiltDevice], ports: Mapping[str, str], seconds: float
) -> Observations:
    seen, loop = Observations(), Loop(WallClock(), time.time_ns())
    system = NodeContainer(loop, robot, 0)
    system.isolate_faults(seen.add_fault)
    loop.add_observer(seen.add)
    nodes = _node_entries(devices, ports)
    topics, end_ns = [device.streams[0].topic for device in devices], loop.now_ns + round(seconds * 1e9)
    try:
        _start(system, nodes, seen)
        while loop.now_ns < end_ns and not all(map(seen.is_measured, topics)):
            _run(loop, end_ns, topics, seen)
    finally:
        system.stop()
    return seen


def _node_entries(devices: Iterable[BuiltDevice], ports: Mapping[str, str]) -> dict[str, NodeEntry]:
    return {
        device.title: NodeEntry(
            kind=f"{device.kind.__module__}:{device.kind.__name__}",
            params={} if issubclass(device.kind, CameraDevice) else {"port": ports[device.title]},
        )
        for device in devices
    }


def _start(system: NodeContainer, nodes: Mapping[str, NodeEntry], seen: Observations) -> None:
    """Start one driver after the other, and remember why one cannot be started."""
    started: dict[str, NodeEntry] = {}
    for name, entry in nodes.items():
        try:
            system.launch(Launch(name="doctor", description="", args={}, nodes={**started, name: entry}))
        except ChefbotError as error:
            seen.faults[name] = str(error)
        else:
            started[name] = entry


def _run(loop: Loop, end_ns: int, topics: Collection[str], seen: Observations) -> None:
    """Run the drivers; the board's gives up where it finds no board, and the others go on."""
    try:
        loop.run(until_ns=end_ns, until=lambda: all(map(seen.is_measured, topics)))
    except ChefbotError as error:
        seen.faults[BOARD] = str(error)


def _lines(device: BuiltDevice, seen: Observations) -> Iterator[str]:
    """Yield the state of a device, and its streams."""
    status = seen.statuses.get(device.status)
    reason = seen.faults.get(device.title) or (
        status.message if status is not None else "it has reported nothing"
    )
    if device.title in seen.faults or status is None or not seen.times.get(device.streams[0].topic):
        yield f"! {device.status}: {reason}"
        return
    mark = "  " if status.level == OK else "! "
    yield f"{mark}{device.status} at {status.hardware_id}: {status.message}"
    for stream in device.streams:
        rate = seen.rate(stream.topic)
        low = rate < MIN_SHARE * stream.rate
        wanted = f", {stream.rate:g} in the robot file" if low else ""
        yield f"{'! ' if low else '  '}  {stream.title}: {rate:.1f} Hz{wanted}"
    if device.kind is MotorBoardDevice and seen.battery is not None:
        yield f"    battery: {seen.battery.voltage:.1f} V"


def _unused(robot: Robot) -> Iterator[str]:
    """Yield the devices of the robot file that have no driver here."""
    if robot.drive.protocol == ROS_BASE:
        yield "  base: not looked at; `chefbot topic hz /base/odom/unfiltered` shows whether it sends"
    for name, topic in TOPICS_WITHOUT_DRIVER.items():
        sensor = getattr(robot.sensors, name)
        if sensor is not None and not sensor.driver:
            yield f"  {name}: without a driver in the robot file, its data are expected on {topic}"
