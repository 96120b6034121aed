"""What an rclpy node (Jazzy, rmw_zenoh 0.2.10) has and expects, against nodes of ours; the peer is bare Zenoh."""

from __future__ import annotations

import queue
import re
import time
from collections.abc import Iterator
from typing import Annotated

import msgspec
import numpy as np
import pytest
import zenoh
from tests.support.bridged_loop import running
from tests.support.waiting import PATIENCE, wait_for

from chefbot.bridge.parameters import _descriptor, to_value
from chefbot.msgs.rcl_interfaces import ParameterValue
from chefbot.msgs.sensor_msgs import Image
from chefbot.nodes.amcl import AmclNode
from chefbot.nodes.controller import ControllerNode
from chefbot.nodes.planner import PlannerNode
from chefbot.ros2.rmw.attachment import Attachment
from chefbot.ros2.rmw.names import InterfaceType, topic_key
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.node import Node
from chefbot.runtime.param_values import flatten

OF_RCLPY = """
MP rosout rcl_interfaces::msg::dds_::Log_ RIHS01_e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac :1:,1000:,:10,0:,,
MP parameter_events rcl_interfaces::msg::dds_::ParameterEvent_ RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204 ::,1000:,:,:,,
SS NODE%describe_parameters rcl_interfaces::srv::dds_::DescribeParameters_ RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff ::,1000:,:,:,,
SS NODE%get_parameters rcl_interfaces::srv::dds_::GetParameters_ RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc ::,1000:,:,:,,
SS NODE%get_parameter_types rcl_interfaces::srv::dds_::GetParameterTypes_ RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca ::,1000:,:,:,,
SS NODE%list_parameters rcl_interfaces::srv::dds_::ListParameters_ RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d ::,1000:,:,:,,
SS NODE%set_parameters rcl_interfaces::srv::dds_::SetParameters_ RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0 ::,1000:,:,:,,
SS NODE%set_parameters_atomically rcl_interfaces::srv::dds_::SetParametersAtomically_ RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd ::,1000:,:,:,,
SS NODE%get_type_description type_description_interfaces::srv::dds_::GetTypeDescription_ RIHS01_69b9c19c1021405984cc60dbbb1edceb147a6538b411d812ba6afabeed962cd5 ::,10:,:,:,,
"""  # noqa: E501 - captured texts are not wrapped
"""Kind, name, type, hash and QoS of what every rclpy node has, captured."""
ACTION = r"MP %deliver%_action%status action_msgs::msg::dds_::GoalStatusArray_ \S+ :1:,1:,:,:,,"


@pytest.fixture
def tokens(port: int) -> Iterator[list[str]]:
    """Those of a running launch, as `liveliness get @ros2_lv/0/**` gives them to a context that has just begun."""
    with running(port, "counter", "cook", "guest") as one:
        wait_for(lambda: "/tf_static" in one.outside.graph.topics())
        with zenoh.open(_config(port)) as session:
            yield wait_for(lambda: _complete(session))


def _complete(session: zenoh.Session) -> list[str]:
    """Return the tokens once a second query has found no others: they arrive one after the other."""
    first, second = _all(session), _all(session)
    return second if first == second else []


def _all(session: zenoh.Session) -> list[str]:
    """Return what a query finds; Zenoh answers one that follows on the heels of its like with nothing."""
    time.sleep(0.25)
    replies = session.liveliness().get("@ros2_lv/0/**")
    return sorted(str(reply.ok.key_expr) for reply in replies if reply.ok is not None)


def _config(port: int) -> zenoh.Config:
    config = zenoh.Config()
    config.insert_json5("mode", '"peer"')
    config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    return config


def _ends(tokens: list[str], node: str) -> set[str]:
    """'MP %rosout TYPE HASH QOS' of a node."""
    fields = [token.split("/") for token in tokens]
    return {" ".join((one[5], *one[9:13])) for one in fields if len(one) >= 13 and one[8] == node}


@pytest.mark.slow
def test_every_node_has_the_endpoints_of_an_rclpy_node(tokens: list[str]) -> None:
    for node in ("counter", "cook", "guest"):
        wanted = {line.replace(" ", " %", 1).replace("NODE", node) for line in OF_RCLPY.strip().splitlines()}
        assert wanted <= _ends(tokens, node), wanted - _ends(tokens, node)
        ids = [token.split("/")[3:5] for token in tokens if token.split("/")[8] == node]
        assert len({one[0] for one in ids}) == 1 and len({one[1] for one in ids}) == len(ids)


@pytest.mark.slow
def test_actions_clocks_and_frames_have_the_qos_of_rclpy(tokens: list[str]) -> None:
    cook, guest = "\n".join(_ends(tokens, "cook")), "\n".join(_ends(tokens, "guest"))
    assert re.search(ACTION, cook)
    for part in ("send_goal", "get_result", "cancel_goal"):
        assert re.search(rf"SS %deliver%_action%{part} \S+ \S+ ::,10:,:,:,,", cook)
        assert re.search(rf"SC %deliver%_action%{part} \S+ \S+ ::,10:,:,:,,", guest)
    feedback = r" %deliver%_action%feedback chefbot_msgs::action::dds_::Deliver_FeedbackMessage_ \S+ ::,10:"
    assert re.search("MP" + feedback, cook) and re.search("MS" + feedback, guest)
    own, ears = "\n".join(_ends(tokens, "chefbot")), "\n".join(_ends(tokens, "chefbot_tf"))
    assert re.search(r"MP %clock rosgraph_msgs::msg::dds_::Clock_ \S+ 2::,1:,:,:,,", own)
    assert re.search(r"MS %tf tf2_msgs::msg::dds_::TFMessage_ \S+ ::,100:,:,:,,", ears)
    assert re.search(r"MS %tf_static tf2_msgs::msg::dds_::TFMessage_ \S+ :1:,100:,:,:,,", ears)


@pytest.mark.parametrize(
    ("node", "port"), [(AmclNode, "amcl_pose"), (ControllerNode, "costmap"), (PlannerNode, "costmap")]
)
def test_topics_latched_in_nav2_are_latched(node: type[Node], port: str) -> None:
    """Its own clients and RViz's settings for it request that, and on DDS receive nothing else."""
    assert getattr(node, port).latched


@pytest.mark.parametrize(
    ("own", "kind"),
    [
        (True, 1),
        (3, 2),
        (0.5, 3),
        ("a", 4),
        ((True, False), 6),
        ((1, 2), 7),
        ((0.5, 1), 8),
        (("a",), 9),
        ((), 9),
    ],
)
def test_parameter_values_have_the_types_of_ros(own: object, kind: int) -> None:
    value = ParameterValue.from_cdr(to_value(own).to_cdr())
    back = value.plain
    assert value.type == kind and (tuple(back) if isinstance(back, list) else back) == own


class Bounded(msgspec.Struct, frozen=True):
    """Numbers with and without bounds."""

    free: float = 1.0
    above: Annotated[float, msgspec.Meta(gt=0.0)] = 1.0
    between: Annotated[int, msgspec.Meta(ge=1, le=9)] = 5


def test_bounded_parameters_have_range_descriptors() -> None:
    descriptors = {name: _descriptor(name, one, True) for name, one in flatten(Bounded()).items()}
    assert descriptors["free"].floating_point_range == ()
    assert descriptors["above"].floating_point_range[0].from_value == 0.0
    (whole,) = descriptors["between"].integer_range
    assert (whole.from_value, whole.to_value, whole.step) == (1, 9, 0)


def test_an_image_on_two_key_expressions_is_received_once(
    wire: RmwContext,
    peer: zenoh.Session,
) -> None:
    got: queue.Queue[Image] = queue.Queue()
    with RmwNode(wire, "viewer") as node:
        node.subscription("/image", Image, got.put)
        key = topic_key(0, "/image", InterfaceType.of(Image))
        wait_for(lambda: peer.declare_publisher(key).matching_status.matching)
        for number in (1, 2, 3):
            attachment = Attachment(number, time.time_ns(), b"n" * 16).pack()
            data = Image(height=number, data=np.zeros(4, np.uint8)).to_cdr()
            peer.put(f"{key}/_buf_cpu", data, attachment=attachment)
            peer.put(key, data, attachment=attachment)
        peer.put(key, Image(height=9).to_cdr(), attachment=Attachment(1, 1, b"o" * 16).pack())
        heights = [got.get(timeout=PATIENCE).height for _ in range(4)]
        assert heights == [1, 2, 3, 9] and got.empty()
