"""Texts and bytes as ROS 2 (Jazzy, rmw_zenoh 0.2.10) writes them; captured, or computed by its rules."""
# ruff: noqa: E501 (captured texts are not wrapped)

from __future__ import annotations

import pytest

from chefbot.msgs.action_msgs import CancelGoal, GoalStatusArray
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.nav_msgs import GetMap, OccupancyGrid, Odometry
from chefbot.msgs.rcl_interfaces import GetParameters, Log, ParameterEvent
from chefbot.msgs.sensor_msgs import CompressedImage, Image, LaserScan, PointCloud2
from chefbot.msgs.std_msgs import String
from chefbot.msgs.std_srvs import SetBool, Trigger
from chefbot.msgs.tf2_msgs import LookupTransform, TFMessage
from chefbot.ros2.rmw.attachment import Attachment, parse
from chefbot.ros2.rmw.errors import RmwError
from chefbot.ros2.rmw.liveliness import EndpointInfo, NodeId, Token, gid_of, parse_token
from chefbot.ros2.rmw.names import InterfaceType, has_byte_array, resolve, ros_name, topic_key
from chefbot.ros2.rmw.qos import (
    DEFAULT,
    PARAMETERS,
    ROSOUT,
    SENSOR_DATA,
    TRANSIENT_LOCAL_QOS,
    QoS,
    QosDuration,
    parse_qos,
)
from chefbot.ros2.rmw.subscription import MAX_PUBLISHERS, is_new

PEER = "@ros2_lv/0/0c6db189a654dce58034f6cdc40249c7/0"
OURS = "a1b2c3d4e5f60718293a4b5c6d7e8f90"

KEYS = [
    (0, "/from_ros", String, "0/from_ros/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
    (0, "/parameter_events", ParameterEvent, "0/parameter_events/rcl_interfaces::msg::dds_::ParameterEvent_/RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204"),
    (0, "/scan", LaserScan, "0/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
    (0, "/map", OccupancyGrid, "0/map/nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7"),
    (7, "/robot1/cmd_vel", Twist, "7/robot1/cmd_vel/geometry_msgs::msg::dds_::Twist_/RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"),
    (0, "/py_setbool", SetBool, "0/py_setbool/std_srvs::srv::dds_::SetBool_/RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a"),
    (0, "/base/get_parameters", GetParameters, "0/base/get_parameters/rcl_interfaces::srv::dds_::GetParameters_/RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc"),
    (0, "/tf2_buffer_server/_action/send_goal", LookupTransform.send_goal_service, "0/tf2_buffer_server/_action/send_goal/tf2_msgs::action::dds_::LookupTransform_SendGoal_/RIHS01_4646ff5706c86b04d0a1098d329951a9731a7517e16702905de6073cc72c8530"),
    (0, "/tf2_buffer_server/_action/get_result", LookupTransform.get_result_service, "0/tf2_buffer_server/_action/get_result/tf2_msgs::action::dds_::LookupTransform_GetResult_/RIHS01_3cd1715751899e3167b5aec3e4ac194f7da9e8493a77285f9f6a4c914f5e8b24"),
    (0, "/tf2_buffer_server/_action/cancel_goal", CancelGoal, "0/tf2_buffer_server/_action/cancel_goal/action_msgs::srv::dds_::CancelGoal_/RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"),
    (0, "/tf2_buffer_server/_action/feedback", LookupTransform.feedback_message, "0/tf2_buffer_server/_action/feedback/tf2_msgs::action::dds_::LookupTransform_FeedbackMessage_/RIHS01_10cb89922dcb103e95c185d43e8a5efa3d38db996f733151a2f3e2ac133f4839"),
    (0, "/tf2_buffer_server/_action/status", GoalStatusArray, "0/tf2_buffer_server/_action/status/action_msgs::msg::dds_::GoalStatusArray_/RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"),
]  # fmt: skip

TOKENS = [
    ("cdf8a82fdad3de3577271575604e754c", f"{PEER}/0/NN/%/%/ros_peer"),
    ("475bb54e4aad75cc71f33d32a741dd8a", f"{PEER}/1/MP/%/%/ros_peer/%rosout/rcl_interfaces::msg::dds_::Log_/RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac/:1:,1000:,:10,0:,,"),
    ("9da8360d20a37be116bd0e663e198924", f"{PEER}/2/MP/%/%/ros_peer/%parameter_events/rcl_interfaces::msg::dds_::ParameterEvent_/RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204/::,1000:,:,:,,"),
    ("84df1e9ec2e1a7d4594c92af41d9653c", f"{PEER}/3/SS/%/%/ros_peer/%ros_peer%describe_parameters/rcl_interfaces::srv::dds_::DescribeParameters_/RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff/::,1000:,:,:,,"),
    ("f12a3795a8034c3e01fac8a004189172", f"{PEER}/9/SS/%/%/ros_peer/%ros_peer%get_type_description/type_description_interfaces::srv::dds_::GetTypeDescription_/RIHS01_69b9c19c1021405984cc60dbbb1edceb147a6538b411d812ba6afabeed962cd5/::,10:,:,:,,"),
    ("22f470a95d2dd2bc32db7b9a8a73b4bd", f"{PEER}/11/MS/%/%/ros_peer/%scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828/2::,5:,:,:,,"),
    ("b828c5189995029ebad384dfcd51bfcd", f"{PEER}/12/MS/%/%/ros_peer/%map/nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7/:1:,1:,:,:,,"),
    ("77b36143d147b006b78a57b0f0cc82e1", f"{PEER}/13/MP/%/%/ros_peer/%from_ros/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,10:,:,:,,"),
    ("f753f12bf4e61c40d8e9bbf13069d2b9", f"{PEER}/14/MP/%/%/ros_peer/%latched_ros/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/:1:,1:,:,:,,"),
    ("b268c9cac812e4d6ff50441d05e36aaf", f"{PEER}/15/SS/%/%/ros_peer/%ros_setbool/std_srvs::srv::dds_::SetBool_/RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a/::,10:,:,:,,"),
    ("f6408c7b64d587eb88e7f3f2ad0b7885", f"{PEER}/16/SC/%/%/ros_peer/%py_setbool/std_srvs::srv::dds_::SetBool_/RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a/::,10:,:,:,,"),
    ("d2a1d7b3baf8abc308f5b6a264e16354", f"@ros2_lv/0/{OURS}/0/0/NN/%/%robot1/base"),
    ("065ce05eab449aa0453c1d04812dcee5", f"@ros2_lv/7/{OURS}/0/0/NN/%chefbot%base/%/base"),
]  # fmt: skip

BASE = NodeId(0, OURS, "0", "/robot1", "base")
MADE = [
    (
        "c80fcdbab2ac2097d6e638cb1ea27a07",
        EndpointInfo("1", "MP", "/robot1/odom", InterfaceType.of(Odometry), DEFAULT),
    ),
    (
        "c0f81855773bfb1b7a5f66dff90fc4a3",
        EndpointInfo("2", "MS", "/robot1/cmd_vel", InterfaceType.of(Twist), DEFAULT),
    ),
    (
        "0451ac2736c5dcd61b9fc6f66bb4fd32",
        EndpointInfo("3", "MP", "/tf_static", InterfaceType.of(TFMessage), TRANSIENT_LOCAL_QOS),
    ),
    (
        "d0ec4ba7b00ff3582cedf41b42608c1a",
        EndpointInfo("4", "SS", "/robot1/base/reset", InterfaceType.of(Trigger), DEFAULT),
    ),
    (
        "092b96a77615d7020fed18c92a1dfc45",
        EndpointInfo("5", "SC", "/map_server/map", InterfaceType.of(GetMap), DEFAULT),
    ),
]

QOS = [
    (QoS(), "::,:,:,:,,"),
    (DEFAULT, "::,10:,:,:,,"),
    (SENSOR_DATA, "2::,5:,:,:,,"),
    (TRANSIENT_LOCAL_QOS, ":1:,1:,:,:,,"),
    (PARAMETERS, "::,1000:,:,:,,"),
    (ROSOUT, ":1:,1000:,:10,0:,,"),
    (QoS(reliability=2, durability=1), "2:1:,:,:,:,,"),
    (QoS(history=2), "::2,:,:,:,,"),
    (QoS(depth=10, deadline=QosDuration(0, 500_000_000)), "::,10:0,500000000:,:,,"),
    (QoS(depth=1, liveliness=3, lease=QosDuration(2, 0)), "::,1:,:,:3,2,0"),
]

REFUSED = [
    "@ros2_lv/0//0/0/NN/%/%/a",
    f"@ros2_lw/0/{OURS}/0/0/NN/%/%/a",
    f"@ros2_lv/0/{OURS}/0/0/XX/%/%/a",
    f"@ros2_lv/x/{OURS}/0/0/NN/%/%/a",
    f"@ros2_lv/0/{OURS}/0/0/NN/%/%",
    TOKENS[1][1].rpartition("/")[0],
    TOKENS[1][1].replace("rcl_interfaces::msg::dds_::Log_", "Log"),
    TOKENS[1][1].replace(":,:10,0:", ":"),
    TOKENS[1][1].replace("1000", "many"),
]


@pytest.mark.parametrize(("domain", "name", "kind", "key"), KEYS, ids=lambda value: str(value)[:40])
def test_key_expressions_equal_those_of_rmw_zenoh(domain: int, name: str, kind, key: str) -> None:
    assert topic_key(domain, name, InterfaceType.of(kind)) == key
    assert ros_name(key.split("/")[-2]) == InterfaceType.of(kind).name


@pytest.mark.parametrize(("gid", "text"), TOKENS)
def test_ros_liveliness_tokens_parse_with_equal_gids(gid: str, text: str) -> None:
    token = parse_token(text)
    assert str(token) == text
    assert token.gid.hex() == gid


@pytest.mark.parametrize(("gid", "end"), MADE)
def test_our_liveliness_tokens_have_the_gids_of_ros(gid: str, end: EndpointInfo) -> None:
    assert Token(BASE, end).gid.hex() == gid


def test_a_liveliness_token_has_node_topic_type_and_qos() -> None:
    token = parse_token(TOKENS[5][1])
    assert token.endpoint is not None
    assert (token.node.full_name, token.endpoint.topic, token.endpoint.kind) == ("/ros_peer", "/scan", "MS")
    assert token.endpoint.type == InterfaceType.of(LaserScan)
    assert token.endpoint.qos == SENSOR_DATA
    newer = parse_token(TOKENS[5][1] + "/backends:cpu:")
    assert newer.endpoint is not None and newer.endpoint.backends == "backends:cpu:"
    assert str(newer).endswith("/backends:cpu:")


@pytest.mark.parametrize("text", REFUSED)
def test_invalid_liveliness_tokens_are_refused(text: str) -> None:
    with pytest.raises(RmwError):
        parse_token(text)


@pytest.mark.parametrize(("qos", "text"), QOS, ids=lambda value: value if isinstance(value, str) else "")
def test_qos_strings_equal_those_of_rmw_zenoh(qos: QoS, text: str) -> None:
    assert str(qos) == text
    assert parse_qos(text) == qos


def test_gids_are_xxh3() -> None:
    assert gid_of("").hex() == "7f498d4624c30160d8984701d306aa99"
    assert gid_of("abc").hex() == "50392f89945faf7885613a73b65ab006"


def test_attachments_equal_those_of_rmw_zenoh() -> None:
    ours = Attachment(1, 1_700_000_000_000_000_000, bytes.fromhex("c80fcdbab2ac2097d6e638cb1ea27a07"))
    assert ours.pack().hex() == "010000000000000000002a36fe9c971710c80fcdbab2ac2097d6e638cb1ea27a07"
    theirs = parse(bytes.fromhex("0100000000000000d8542e54cdeae9181077b36143d147b006b78a57b0f0cc82e1"))
    assert theirs.sequence == 1
    assert theirs.gid.hex() == TOKENS[7][0]


@pytest.mark.parametrize("data", [None, b"", b"\0" * 32, b"\0" * 34, b"\0" * 33])
def test_invalid_attachments_are_refused(data: bytes | None) -> None:
    with pytest.raises(RmwError, match="attachment"):
        parse(data)


def test_types_with_byte_arrays() -> None:
    assert all(map(has_byte_array, (Image, CompressedImage, PointCloud2)))
    assert not any(map(has_byte_array, (LaserScan, OccupancyGrid, Log, Twist)))


def test_names_are_resolved_as_in_ros() -> None:
    assert resolve("scan") == "/scan"
    assert resolve("scan", "/robot1") == "/robot1/scan"
    assert resolve("/tf", "/robot1") == "/tf"
    assert resolve("~/get_parameters", "/robot1", "/robot1/base") == "/robot1/base/get_parameters"
    for bad in ("", "/", "a//b", "1a", "a-b", "scan/", "a b", "/a/*"):
        with pytest.raises(RmwError):
            resolve(bad)


def test_a_sample_on_both_keys_is_taken_once() -> None:
    """The one that has been silent for longest is forgotten, not all of them."""
    last: dict[bytes, int] = {}
    gids = [number.to_bytes(16, "little") for number in range(MAX_PUBLISHERS + 1)]
    for gid in gids[:-1]:
        assert is_new(Attachment(1, 0, gid), last)
    assert is_new(Attachment(2, 0, gids[0]), last), "it is the most recent one now"
    assert is_new(Attachment(1, 0, gids[-1]), last)
    assert len(last) == MAX_PUBLISHERS and gids[1] not in last
    assert [gid for gid in gids[2:-1] if is_new(Attachment(1, 0, gid), last)] == []
    assert not is_new(Attachment(2, 0, gids[0]), last)
