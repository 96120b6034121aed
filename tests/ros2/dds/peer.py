"""A stand-in for a ROS 2 process on DDS: Cyclone's own Python API, its own IDL types, nothing of chefbot's.

Commands come as lines on standard input, answers go as lines of JSON to standard output.
"""

import json
import sys
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int8, int32, sequence, uint8, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic


def ros(name: str, /, **fields: Any) -> type[Any]:
    """`package/Name` as ROS 2 calls it on DDS."""
    package, _, short = name.partition("/")
    return make_idl_struct(f"{short}_", f"{package}::msg::dds_::{short}_", fields)


Time_ = ros("builtin_interfaces/Time", sec=int32, nanosec=uint32)
Header_ = ros("std_msgs/Header", stamp=Time_, frame_id=str)
String_ = ros("std_msgs/String", data=str)
Vector3_ = ros("geometry_msgs/Vector3", x=float64, y=float64, z=float64)
Twist_ = ros("geometry_msgs/Twist", linear=Vector3_, angular=Vector3_)
LaserScan_ = ros(
    "sensor_msgs/LaserScan",
    header=Header_,
    angle_min=float32,
    angle_max=float32,
    angle_increment=float32,
    time_increment=float32,
    scan_time=float32,
    range_min=float32,
    range_max=float32,
    ranges=sequence[float32],
    intensities=sequence[float32],
)
Image_ = ros(
    "sensor_msgs/Image",
    header=Header_,
    height=uint32,
    width=uint32,
    encoding=str,
    is_bigendian=uint8,
    step=uint32,
    data=sequence[uint8],
)
Point_ = ros("geometry_msgs/Point", x=float64, y=float64, z=float64)
Quaternion_ = ros("geometry_msgs/Quaternion", x=float64, y=float64, z=float64, w=float64)
Pose_ = ros("geometry_msgs/Pose", position=Point_, orientation=Quaternion_)
MapMetaData_ = ros(
    "nav_msgs/MapMetaData", map_load_time=Time_, resolution=float32, width=uint32, height=uint32, origin=Pose_
)
OccupancyGrid_ = ros("nav_msgs/OccupancyGrid", header=Header_, info=MapMetaData_, data=sequence[int8])
Unknown_ = ros("elsewhere_msgs/Unknown", data=str)
Shorter_ = ros("geometry_msgs/Twist", linear=Vector3_)  # not what others call so
KeyValue_ = ros("diagnostic_msgs/KeyValue", key=str, value=str)
DiagnosticStatus_ = ros(
    "diagnostic_msgs/DiagnosticStatus",
    level=uint8,  # a byte, as ROS 2's own DDS layers declare it
    name=str,
    message=str,
    hardware_id=str,
    values=sequence[KeyValue_],
)
DiagnosticArray_ = ros("diagnostic_msgs/DiagnosticArray", header=Header_, status=sequence[DiagnosticStatus_])
Gid_ = ros("rmw_dds_common/Gid", data=array[uint8, 16])
NodeEntitiesInfo_ = ros(
    "rmw_dds_common/NodeEntitiesInfo",
    node_namespace=bounded_str[256],
    node_name=bounded_str[256],
    reader_gid_seq=sequence[Gid_],
    writer_gid_seq=sequence[Gid_],
)
ParticipantEntitiesInfo_ = ros(
    "rmw_dds_common/ParticipantEntitiesInfo", gid=Gid_, node_entities_info_seq=sequence[NodeEntitiesInfo_]
)

TYPES = {
    "String": String_,
    "Twist": Twist_,
    "LaserScan": LaserScan_,
    "Image": Image_,
    "OccupancyGrid": OccupancyGrid_,
    "Unknown": Unknown_,
    "DiagnosticArray": DiagnosticArray_,
    "Shorter": Shorter_,
}
LATCHED = (Policy.Durability.TransientLocal, Policy.History.KeepLast(1))


def qos_of(how: str, type_hash: str) -> Qos:
    """`how`: any of best_effort, latched, all; without one reliable, volatile."""
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
    """One participant with the readers and writers that a test requests."""

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
        """Subscribe from now on."""
        made = Topic(self.participant, topic, TYPES[kind])
        self.readers[topic] = DataReader(self.participant, made, qos_of(how, type_hash))

    def write(self, topic: str, kind: str, how: str = "", type_hash: str = "") -> None:
        """Be able to publish from now on."""
        made = Topic(self.participant, topic, TYPES[kind])
        self.writers[topic] = DataWriter(self.participant, made, qos_of(how, type_hash))

    def forget(self, topic: str) -> None:
        """No longer read or write."""
        self.readers.pop(topic, None)
        self.writers.pop(topic, None)

    def publish(self, topic: str, *values: Any) -> None:
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
        """How many subscribe to what is written here."""
        return len(self.writers[topic].get_matched_subscriptions())

    def sources(self, topic: str) -> int:
        """How many publish what is read here."""
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
        """Nodes as announced on ros_discovery_info: full name, GIDs of readers, of writers."""
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
