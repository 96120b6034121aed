"""The vocabulary of faults: each kind of fault is a struct, which a YAML file writes as

- {at: 30, until: 45, fault: freeze, sensor: lidar}
- {at: 60, fault: bump, impulse: 4, direction: 1.57}
- {at: 70, until: 80, fault: hung, node: planner}
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, TypeAlias, get_args

import msgspec
from msgspec import Meta

OF_SENSOR = Meta(description="sensor that fails")
Sensor = Annotated[Literal["lidar", "depth_camera", "ultrasonic", "imu", "wheel_encoders"], OF_SENSOR]
Wheel = Annotated[Literal["left", "right", "both"], Meta(description="wheel that fails")]
Clock = Annotated[
    Literal["board", "lidar", "depth_camera"], Meta(description="device whose messages the clock stamps")
]
NodeName = Annotated[str, Meta(min_length=1, max_length=64, description="name of a node of the launch")]
Second = Annotated[float, Meta(ge=0, le=1e6)]
Delay = Annotated[float, Meta(gt=0, le=60)]
OFFSETS = {
    "yaw": ("lidar", "depth_camera"),
    "range": ("lidar", "depth_camera", "ultrasonic"),
    "rate": ("imu",),
}
"""Sensors that each key of the fault `offset` fits."""


class InjectedFault(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="fault"):
    """What all faults have: the time at which they begin."""

    at: Annotated[Second, Meta(description="begin, s of simulated time")]


class LastingFault(InjectedFault, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fault that ends; afterwards everything works as before."""

    until: Annotated[Second | None, Meta(description="end, s of simulated time; not given: it stays")] = None

    def __post_init__(self) -> None:
        """Raise ValueError if the fault ends before it begins."""
        if self.until is not None and self.until <= self.at:
            raise ValueError(f"`until` is {self.until:g} s, but must be later than `at`, {self.at:g} s")


class SensorStop(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="stop"):
    """A sensor stops: no messages of lidar and depth camera, no echo, no answer of the IMU, no ticks."""

    sensor: Sensor


class SensorFreeze(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="freeze"):
    """A sensor repeats its last reading with new stamps; the count of an encoder stays."""

    sensor: Sensor


class SensorLate(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="late"):
    """Readings come late: scans and images keep their stamps, those of the motor board get the board's."""

    sensor: Sensor
    seconds: Annotated[Delay, Meta(description="delay, s")] = 1.0


class SensorNoise(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="noise"):
    """Readings are multiplied by 1 + `share` times a standard normal number."""

    sensor: Sensor
    share: Annotated[float, Meta(gt=0, le=2, description="standard deviation as a share of the reading")] = (
        0.3
    )


class SensorHalfBlind(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="half_blind"):
    """No measurement (NaN) in the front half of a scan, or in the left half of an image."""

    sensor: Annotated[Literal["lidar", "depth_camera"], OF_SENSOR]


class SensorOffset(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="offset"):
    """A sensor whose mount has turned, or whose readings are off by a constant."""

    sensor: Annotated[Literal["lidar", "depth_camera", "ultrasonic", "imu"], OF_SENSOR]
    yaw: Annotated[
        float,
        Meta(ge=-math.pi, le=math.pi, description="turn of the mount to the left, rad: lidar, depth_camera"),
    ] = 0.0
    range: Annotated[
        float, Meta(ge=-5, le=5, description="added to each range, m: lidar, depth_camera, ultrasonic")
    ] = 0.0
    rate: Annotated[float, Meta(ge=-1, le=1, description="added to the turn rate about z, rad/s: imu")] = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError if no key is given, or one that the sensor does not have."""
        super().__post_init__()
        given = [key for key in OFFSETS if getattr(self, key)]
        fitting = [key for key, sensors in OFFSETS.items() if self.sensor in sensors]
        if not given or not set(given) <= set(fitting):
            raise ValueError(f"the offset of sensor {self.sensor} needs {' or '.join(fitting)}, not 0")


class SensorUpsideDown(
    LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="upside_down"
):
    """A sensor is mounted upside down: turned by 180 degrees about its forward axis."""

    sensor: Annotated[Literal["lidar", "depth_camera", "imu"], OF_SENSOR]


class WheelSlip(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="slip"):
    """A wheel slips on a wet or oily floor."""

    wheel: Wheel
    share: Annotated[float, Meta(gt=0, lt=1, description="share of the tyre's friction that is left")] = 0.1


class WheelStall(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="stall"):
    """A wheel is blocked: it does not turn, whatever its motor does."""

    wheel: Wheel


class Bump(InjectedFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="bump"):
    """The robot is shoved: a short horizontal force acts on its centre of mass."""

    impulse: Annotated[float, Meta(gt=0, le=100, description="impulse, N s, spread over 0.1 s")] = 3.0
    direction: Annotated[
        float,
        Meta(
            ge=-math.pi, le=math.pi, description="direction of the shove from straight ahead to the left, rad"
        ),
    ] = math.pi / 2


class Carried(InjectedFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="carried"):
    """The robot is lifted and set down elsewhere (kidnapped robot)."""

    to: Annotated[
        tuple[float, float, float] | None,
        Meta(description="[x, y, yaw] in the world frame, m and rad; not given: drawn by the seed"),
    ] = None


class VoltageDrop(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="voltage_drop"):
    """The terminal voltage drops, for the motors and for the reading."""

    share: Annotated[float, Meta(ge=0, lt=1, description="share of the voltage that is left")] = 0.75


class WrongVoltageReading(
    LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="wrong_voltage_reading"
):
    """The board measures another voltage than the battery has."""

    voltage: Annotated[float, Meta(ge=0, le=65, description="voltage that is measured, V")]


class BoardUnplugged(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="unplugged"):
    """The cable of the serial link is out: no byte gets through, the board itself keeps running."""


class BitErrors(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="bit_errors"):
    """Bits of the serial link flip in both directions."""

    rate: Annotated[float, Meta(gt=0, le=0.5, description="probability that a bit flips")] = 0.001


class ClockJump(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="jump"):
    """The clock that stamps a device's messages jumps; at the end of the fault it jumps back."""

    clock: Clock
    seconds: Annotated[float, Meta(ge=-3600, le=3600, description="jump, s; forward is positive")]


class NodeKilled(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="killed"):
    """A node dies without a last message; at the end of the fault it is created again from its parameters."""

    node: NodeName


class NodeHung(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="hung"):
    """A node's callbacks wait until the fault ends; each topic's queue keeps its last messages."""

    node: NodeName


class Slow(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="slow"):
    """Each callback of a node takes longer, so that they queue; or each message of a link comes later."""

    node: Annotated[str, Meta(max_length=64, description="name of the node; or else `link`")] = ""
    link: Annotated[str, Meta(max_length=64, description="node at one end of the link; or else `node`")] = ""
    topics: Annotated[tuple[str, ...], Meta(description="topics of the link; none given: all")] = ()
    seconds: Annotated[Delay, Meta(description="how much longer, or later, s")] = 0.2

    def __post_init__(self) -> None:
        """Raise ValueError unless either a node or a link is named."""
        super().__post_init__()
        if bool(self.node) == bool(self.link):
            raise ValueError("slow needs either node or link")
        if self.topics and self.node:
            raise ValueError("topics are of a link, not of a node")


class LinkCut(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="cut"):
    """No message passes between a node and all others; then the last one of each latched topic follows."""

    link: Annotated[str, Meta(min_length=1, max_length=64, description="node at one end of the link")]
    topics: Annotated[tuple[str, ...], Meta(description="topics of the link; none given: all")] = ()


class LinkBlackHole(LastingFault, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="black_hole"):
    """Messages between a node and all others are lost; nothing follows, as no end notices it."""

    link: Annotated[str, Meta(min_length=1, max_length=64, description="node at one end of the link")]
    topics: Annotated[tuple[str, ...], Meta(description="topics of the link; none given: all")] = ()


SensorFault: TypeAlias = (
    SensorStop | SensorFreeze | SensorLate | SensorNoise | SensorHalfBlind | SensorOffset | SensorUpsideDown
)
WheelFault: TypeAlias = WheelSlip | WheelStall | Bump | Carried
BoardFault: TypeAlias = VoltageDrop | WrongVoltageReading | BoardUnplugged | BitErrors | ClockJump
SimulatorFault: TypeAlias = SensorFault | WheelFault | BoardFault
"""Faults of what the simulator simulates: sensors, wheels, battery, board, and the clocks of devices."""
LinkFault: TypeAlias = LinkCut | LinkBlackHole
NodeFault: TypeAlias = NodeKilled | NodeHung | Slow | LinkFault
"""Faults of nodes and of the links between them, which `NodeFaultsNode` injects."""
FaultEvent: TypeAlias = SimulatorFault | NodeFault
"""Any fault."""
KINDS: tuple[type[InjectedFault], ...] = get_args(FaultEvent)
"""The structs of all faults in the order of the documentation."""
