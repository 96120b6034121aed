"""A stand-in for a ROS 2 process that speaks DDS: Cyclone's own Python API, its own IDL types, nothing of chefbot's.

Commands come as lines on standard input, answers go as lines of JSON to standard output.
"""

# ruff: noqa: N801  (names end in _ as ROS 2's do on DDS; annotations are objects, as Cyclone wants them)

import json
import sys
from dataclasses import dataclass
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int8, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic


@dataclass
class Time_(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header_(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time_
    frame_id: str


@dataclass
class String_(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
class Vector3_(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Twist_(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector3_
    angular: Vector3_


@dataclass
class LaserScan_(IdlStruct, typename="sensor_msgs::msg::dds_::LaserScan_"):
    header: Header_
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class Image_(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    header: Header_
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]


@dataclass
class Point_(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion_(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose_(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Point_
    orientation: Quaternion_


@dataclass
class MapMetaData_(IdlStruct, typename="nav_msgs::msg::dds_::MapMetaData_"):
    map_load_time: Time_
    resolution: float32
    width: uint32
    height: uint32
    origin: Pose_


@dataclass
class OccupancyGrid_(IdlStruct, typename="nav_msgs::msg::dds_::OccupancyGrid_"):
    header: Header_
    info: MapMetaData_
    data: sequence[int8]


@dataclass
class Unheard_(IdlStruct, typename="elsewhere_msgs::msg::dds_::Unheard_"):
    data: str


@dataclass
class Shorter(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Not what others call so."""

    linear: Vector3_


@dataclass
class Gid_(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
    data: array[uint8, 16]


@dataclass
class NodeEntitiesInfo_(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
    node_namespace: bounded_str[256]
    node_name: bounded_str[256]
    reader_gid_seq: sequence[Gid_]
    writer_gid_seq: sequence[Gid_]


@dataclass
class ParticipantEntitiesInfo_(IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"):
    gid: Gid_
    node_entities_info_seq: sequence[NodeEntitiesInfo_]


TYPES = {
    one.__name__.rstrip("_"): one
    for one in (String_, Twist_, LaserScan_, Image_, OccupancyGrid_, Unheard_, Shorter)
}
LATCHED = (Policy.Durability.TransientLocal, Policy.History.KeepLast(1))


def qos_of(how: str, type_hash: str) -> Qos:
    """`how`: words of best_effort, latched, all; without one reliable, volatile."""
    policies: list[Any] = [
        Policy.Reliability.BestEffort if "best_effort" in how else Policy.Reliability.Reliable(10**8)
    ]
    policies += LATCHED if "latched" in how else (Policy.Durability.Volatile, Policy.History.KeepLast(200))
    if type_hash:
        policies.append(Policy.Userdata(f"typehash={type_hash};".encode()))
    made = Qos(*policies)
    if "latched" in how:
        made += Qos(Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1))
    if "all" in how:
        made += Qos(Policy.History.KeepAll)
    return made


class Peer:
    """One participant and what it was told to have."""

    def __init__(self, domain: int) -> None:
        self.participant = DomainParticipant(domain, Qos(Policy.Userdata(b"enclave=/;")))
        self.own = self.participant.guid
        self.seen = {
            "participants": BuiltinDataReader(self.participant, BuiltinTopicDcpsParticipant),
            "writers": BuiltinDataReader(self.participant, BuiltinTopicDcpsPublication),
            "readers": BuiltinDataReader(self.participant, BuiltinTopicDcpsSubscription),
        }
        info = Topic(self.participant, "ros_discovery_info", ParticipantEntitiesInfo_)
        self.nodes = DataReader(self.participant, info, qos_of("latched", ""))
        self.readers: dict[str, DataReader[Any]] = {}
        self.writers: dict[str, DataWriter[Any]] = {}

    def read(self, topic: str, kind: str, how: str = "", type_hash: str = "") -> None:
        """Listen from now on."""
        made = Topic(self.participant, topic, TYPES[kind])
        self.readers[topic] = DataReader(self.participant, made, qos_of(how, type_hash))

    def write(self, topic: str, kind: str, how: str = "", type_hash: str = "") -> None:
        """Be able to speak from now on."""
        made = Topic(self.participant, topic, TYPES[kind])
        self.writers[topic] = DataWriter(self.participant, made, qos_of(how, type_hash))

    def forget(self, topic: str) -> None:
        """No longer read or write."""
        self.readers.pop(topic, None)
        self.writers.pop(topic, None)

    def say(self, topic: str, *values: Any) -> None:
        """A text, a twist's speeds, a picture of one value, a scan."""
        writer = self.writers[topic]
        writer.write(make(writer.data_type, *values))

    def flood(self, topic: str, count: int, *values: Any) -> None:
        """The same very often."""
        writer = self.writers[topic]
        one = make(writer.data_type, *values)
        for _ in range(count):
            writer.write(one)

    def take(self, topic: str) -> list[Any]:
        """What has come since, shortened."""
        return [short(one) for one in self.readers[topic].take(1000) if one.sample_info.valid_data]

    def matched(self, topic: str) -> int:
        """How many listen to what is written here."""
        return len(self.writers[topic].get_matched_subscriptions())

    def sources(self, topic: str) -> int:
        """How many speak to what is read here."""
        return len(self.readers[topic].get_matched_publications())

    def ends(self, what: str) -> list[list[str]]:
        """Topic, type, user data, GID of all others' readers or writers."""
        return [
            [one.topic_name, one.type_name, data_of(one.qos), one.key.hex]
            for one in self.seen[what].read(1000)
            if one.sample_info.instance_state == InstanceState.Alive and one.participant_key != self.own
        ]

    def participants(self) -> list[str]:
        """User data of the others."""
        alive = [
            one
            for one in self.seen["participants"].read(1000)
            if one.sample_info.instance_state == InstanceState.Alive and one.key != self.own
        ]
        return [data_of(one.qos) for one in alive]

    def graph(self) -> list[Any]:
        """Nodes as told on ros_discovery_info: full name, GIDs of readers, of writers."""
        latest = {bytes(one.gid.data): one for one in self.nodes.read(1000) if one.sample_info.valid_data}
        return [
            [
                f"{node.node_namespace.rstrip('/')}/{node.node_name}",
                [bytes(gid.data).hex() for gid in node.reader_gid_seq],
                [bytes(gid.data).hex() for gid in node.writer_gid_seq],
            ]
            for one in latest.values()
            for node in one.node_entities_info_seq
        ]


def make(kind: type[Any], *values: Any) -> Any:
    """A sample of few values."""
    if kind is Twist_:
        return Twist_(Vector3_(values[0], 0.0, 0.0), Vector3_(0.0, 0.0, values[1]))
    if kind is LaserScan_:
        ranges = [float(values[0])] * 640
        return LaserScan_(Header_(Time_(1, 2), "laser"), -1.0, 1.0, 0.01, 0.0, 0.1, 0.1, 30.0, ranges, [])
    return kind(*values)


def short(one: Any) -> Any:
    """What a test compares."""
    if isinstance(one, Twist_):
        return [one.linear.x, one.angular.z]
    if isinstance(one, LaserScan_):
        return [one.header.frame_id, len(one.ranges), sum(one.ranges)]
    if isinstance(one, Image_):
        return [one.height, one.width, one.encoding, len(one.data), sum(one.data)]
    if isinstance(one, OccupancyGrid_):
        return [one.header.frame_id, one.info.width, one.info.height, len(one.data), sum(one.data)]
    return one.data


def data_of(qos: Qos) -> str:
    """User data as text."""
    found = qos[Policy.Userdata]
    return found.data.decode("ascii", "replace") if found else ""


def answer(value: Any) -> None:
    """A line of JSON."""
    sys.stdout.write(json.dumps(value) + "\n")
    sys.stdout.flush()


def main(domain: int) -> None:
    """Until standard input ends."""
    peer = Peer(domain)
    answer("ready")
    for line in sys.stdin:
        name, *values = json.loads(line)
        answer(getattr(peer, name)(*values))


if __name__ == "__main__":
    main(int(sys.argv[1]))
