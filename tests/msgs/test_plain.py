"""Messages as people write and read them."""

from __future__ import annotations

import math

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.geometry_msgs import PoseStamped, Twist
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.fields import fields_of, ros_type
from chefbot.msgs.idl.message import Message
from chefbot.msgs.idl.yaml_conversion import message_from_dict, message_to_dict
from chefbot.msgs.sensor_msgs import Image, Imu, LaserScan, Range
from chefbot.msgs.std_msgs import Float32, String
from chefbot.ros2.tools.common import to_yaml
from tests.support.messages import all_messages, instances_of

MESSAGES = {ros_type(one): one for one in all_messages()}


@given(st.data())
@settings(max_examples=200)
@pytest.mark.slow
def test_every_message_round_trips_through_yaml(data: st.DataObject) -> None:
    kind = MESSAGES[data.draw(st.sampled_from(sorted(MESSAGES)))]
    message = data.draw(instances_of(kind))
    assert (
        message_from_dict(kind, yaml.safe_load(to_yaml(message_to_dict(message))), "it").to_cdr()
        == message.to_cdr()
    )


@pytest.mark.parametrize("text", ["\x85", "a\u2028b", "\n", " a\n\n b", "", "null", "é"])
def test_any_text_round_trips(text: str) -> None:
    """In a list of its own indentation, where the YAML library once lost them."""
    assert yaml.safe_load(to_yaml([{"of": {"data": text}}])) == [{"of": {"data": text}}]


@pytest.mark.parametrize("name", sorted(MESSAGES))
def test_missing_fields_get_their_defaults(name: str) -> None:
    kind = MESSAGES[name]
    assert (
        message_from_dict(kind, None, "it").to_cdr()
        == message_from_dict(kind, {}, "it").to_cdr()
        == kind().to_cdr()
    )
    assert set(message_to_dict(kind())) == {field.name for field in fields_of(kind)}


def test_nan_and_infinity_are_written_as_in_yaml() -> None:
    for value, text in ((math.nan, ".nan"), (math.inf, ".inf"), (-math.inf, "-.inf")):
        written = yaml.safe_dump(message_to_dict(Float32(value)))
        assert text in written
        assert repr(message_from_dict(Float32, yaml.safe_load(written), "it").data) == repr(value)


def test_single_precision_values_print_as_written() -> None:
    assert message_to_dict(Float32(0.1)) == {"data": 0.1}


def test_long_arrays_are_truncated_with_a_note() -> None:
    plain = message_to_dict(LaserScan(ranges=[1.0] * 640), max_elements=3)
    assert plain["ranges"] == [1.0, 1.0, 1.0, "... 637 more"]


def test_now_is_the_current_time_and_auto_fills_the_header() -> None:
    now = Time(5, 6)
    assert message_from_dict(PoseStamped, {"header": "auto"}, "it", now).header.stamp.ns == now.ns
    made = message_from_dict(PoseStamped, {"header": {"stamp": "now", "frame_id": "map"}}, "it", now)
    assert (made.header.stamp.ns, made.header.frame_id) == (now.ns, "map")


def test_1e3_is_parsed_as_a_number() -> None:
    assert message_from_dict(Twist, yaml.safe_load("{linear: {x: 1e-3}}"), "it").linear.x == 1e-3


@pytest.mark.parametrize(
    ("kind", "plain", "sentence"),
    [
        (Twist, {"linaer": {}}, "no field 'linaer' (did you mean 'linear'?)"),
        (Twist, {"linear": {"x": "fast"}}, "linear: x is a number, not 'fast'"),
        (Twist, {"linear": {"x": True}}, "linear: x is a number, not True"),
        (Twist, {"linear": [1, 2, 3]}, "has the fields x, y, z"),
        (Twist, 3, "has the fields linear, angular"),
        (String, {"data": 3}, "is a text, not 3; put it in quotes"),
        (Image, {"height": -1}, "must lie between 0 and 4294967295"),
        (Image, {"height": 1.5}, "is a whole number, not 1.5"),
        (Image, {"height": True}, "is a whole number, not True"),
        (Image, {"data": [256]}, "data[0] must lie between 0 and 255"),
        (Image, {"data": "x"}, "is a list"),
        (Imu, {"orientation_covariance": [0.0] * 8}, "has 9 elements, not 8"),
        (Range, {"header": "now"}, "has the fields stamp, frame_id"),
    ],
)
def test_invalid_values_are_refused_in_one_sentence(
    kind: type[Message], plain: object, sentence: str
) -> None:
    with pytest.raises(InvalidMessageError) as error:
        message_from_dict(kind, plain, "values", Time(1, 0))
    assert sentence in str(error.value) and str(error.value).startswith("values: ")
