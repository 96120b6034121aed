"""Our bytes against those of an independent implementation."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.idl.action import Action
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.definition import definition_text, type_hash
from chefbot.msgs.idl.fields import fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.registry import action_type, message_type, service_type
from chefbot.msgs.idl.service import Service
from chefbot.msgs.rcl_interfaces import IntegerRange, ParameterDescriptor
from chefbot.msgs.sensor_msgs import Image, LaserScan, Range
from chefbot.msgs.std_msgs import String
from tests.support.messages import all_messages, all_modules, instances_of

STORE = get_typestore(Stores.ROS2_JAZZY)


KNOWN = [one for one in all_messages() if ros_type(one) in STORE.fielddefs]


def theirs(message: Message):
    """The same message as the other library's object."""
    values = []
    for field in fields_of(type(message)):
        value = getattr(message, field.name)
        if field.message is not None:
            value = [theirs(one) for one in value] if field.is_array else theirs(value)
        elif field.element == "string" and field.is_array:
            value = list(value)
        values.append(value)
    return STORE.types[ros_type(type(message))](*values)


@pytest.mark.parametrize("kind", KNOWN, ids=ros_type)
@settings(max_examples=8)
@given(data=st.data())
def test_bytes_equal_those_of_rosbags_and_read_back(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(instances_of(kind))
    ours = message.to_cdr()
    assert ours == bytes(STORE.serialize_cdr(theirs(message), ros_type(kind)))
    assert kind.from_cdr(ours).to_cdr() == ours


@pytest.mark.parametrize("kind", all_messages(), ids=ros_type)
def test_every_message_round_trips_and_is_found_by_name(kind: type[Message]) -> None:
    assert kind.from_cdr(kind().to_cdr()).to_cdr() == kind().to_cdr()
    assert message_type(ros_type(kind)) is kind
    assert definition_text(kind)


def test_type_hashes_equal_those_of_ros(shared) -> None:
    known = json.loads(shared("data/ros2/type_hashes.json").read_text())
    ours = {ros_type(one): type_hash(one) for one in all_messages() if ros_type(one) in known}
    assert len(ours) >= 125
    assert ours == {name: known[name] for name in ours}


def test_service_and_action_hashes_equal_those_of_ros(shared) -> None:
    known = json.loads(shared("data/ros2/type_hashes.json").read_text())
    found = [value for module in all_modules() for value in vars(module).values()]
    actions = [one for one in found if isinstance(one, Action)]
    services = [one for one in found if isinstance(one, Service)]
    services += [part for one in actions for part in (one.send_goal_service, one.get_result_service)]
    ours = {one.name: one.type_hash for one in services} | {one.ros_name: one.type_hash for one in actions}
    both = ours.keys() & known.keys()
    assert len(both) >= 18 and "tf2_msgs/action/LookupTransform" in both
    assert {name: ours[name] for name in both} == {name: known[name] for name in both}


def test_services_and_actions_are_found_by_name() -> None:
    assert service_type("std_srvs/srv/SetBool").request.__name__ == "SetBool_Request"
    navigate = action_type("nav2_msgs/action/NavigateToPose")
    assert service_type("nav2_msgs/action/NavigateToPose_SendGoal") is navigate.send_goal_service
    with pytest.raises(KeyError, match="is not a service type"):
        service_type("std_msgs/msg/String")
    with pytest.raises(KeyError, match="no type is called"):
        action_type("nav2_msgs/action/Fly")


def test_a_sequence_beyond_its_bound_is_refused() -> None:
    with pytest.raises(CdrError, match="bound"):
        ParameterDescriptor(integer_range=(IntegerRange(), IntegerRange())).to_cdr()


@settings(max_examples=200)
@given(
    cut=st.integers(0, 100), flips=st.lists(st.tuples(st.integers(0, 99), st.integers(0, 255)), max_size=4)
)
def test_damaged_bytes_raise_cdr_error_only(cut: int, flips: list[tuple[int, int]]) -> None:
    scan = LaserScan(angle_min=-1.0, ranges=np.ones(10, np.float32))
    data = bytearray(scan.to_cdr())
    for place, value in flips:
        data[place % len(data)] = value
    try:
        LaserScan.from_cdr(bytes(data[:cut]))
    except CdrError:
        return
    assert cut >= len(data) - 8


@pytest.mark.parametrize("empty", [b"\0\0\0\0", b"\1\0\0\0\0"])
def test_a_string_without_terminator_is_empty_as_in_fast_cdr(empty: bytes) -> None:
    assert String.from_cdr(b"\0\1\0\0" + empty).data == ""
    assert Order.from_cdr(b"\0\1\0\0" + b"\1\0\0\0" + empty + bytes(12)).places == ("",)


def test_an_invalid_value_is_refused_with_its_type() -> None:
    with pytest.raises(CdrError, match="sensor_msgs/msg/Range"):
        Range(radiation_type=300).to_cdr()


def test_fields_are_rounded_to_their_wire_type() -> None:
    scan = LaserScan(angle_min=0.1, ranges=np.array([0.1], np.float64))
    back = LaserScan.from_cdr(scan.to_cdr())
    assert back.angle_min == scan.angle_min == float(np.float32(0.1))
    assert back.ranges[0] == scan.ranges[0]


def test_nan_and_infinity_round_trip() -> None:
    scan = LaserScan(ranges=np.array([math.inf, math.nan, 1.0], np.float32))
    back = LaserScan.from_cdr(scan.to_cdr()).ranges
    assert math.isinf(back[0]) and math.isnan(back[1]) and back[2] == 1.0


@pytest.mark.parametrize("pixels", [np.zeros((40, 30, 3), np.uint8), np.arange(6000, dtype=np.uint8)[::2]])
def test_large_and_strided_arrays_encode_like_small_ones(pixels: np.ndarray) -> None:
    image = Image(encoding="rgb8", data=pixels)
    assert image.to_cdr() == bytes(
        STORE.serialize_cdr(theirs(Image(encoding="rgb8", data=pixels.ravel())), ros_type(Image))
    )
    assert Image.from_cdr(image.to_cdr()).data.tolist() == pixels.ravel().tolist()


def test_numbers_of_any_type_are_rounded() -> None:
    scan = LaserScan(angle_min=1, angle_max=np.float64(0.1), range_max=1e39, ranges=[1, 2])
    assert (type(scan.angle_min), scan.angle_max, scan.range_max) == (float, float(np.float32(0.1)), math.inf)
    assert scan.ranges.dtype == np.float32
    with pytest.raises(TypeError):
        LaserScan(angle_min="wide")


def test_a_message_built_from_a_decoded_one_is_rounded_too() -> None:
    read = LaserScan.from_cdr(LaserScan(angle_min=0.1).to_cdr())
    assert LaserScan(angle_min=read.angle_min, angle_max=0.1).angle_max == read.angle_min
