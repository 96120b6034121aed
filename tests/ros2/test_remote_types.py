"""Classes built from type descriptions that a node provides; malicious ones are refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.support.messages import all_messages, instances_of

from chefbot.msgs.idl.definition import Description, FieldDescription, describe
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.remote_types import make_class


@pytest.mark.slow
@given(st.data())
@settings(max_examples=100)
def test_classes_built_from_type_descriptions_are_equal_to_ours(data: st.DataObject) -> None:
    kind = data.draw(st.sampled_from(all_messages()))
    message = data.draw(instances_of(kind))
    made = make_class(describe(kind))
    assert made.from_cdr(message.to_cdr()).to_cdr() == message.to_cdr()
    assert describe(made).fields == describe(kind).fields


@pytest.mark.parametrize(
    "field",
    [
        FieldDescription("x; import os", 11, 0, 0, ""),
        FieldDescription("class", 11, 0, 0, ""),
        FieldDescription("x", 1, 0, 0, "their_msgs/msg/Thing"),
        FieldDescription("x", 1, 0, 0, "their_msgs/msg/Missing"),
        FieldDescription("x", 18, 0, 0, ""),
        FieldDescription("x", 48 + 11, 10**12, 0, ""),
        FieldDescription("x", 48 + 17, 2, 0, ""),
        FieldDescription("x", 250, 0, 0, ""),
    ],
)
def test_malicious_definitions_are_refused(field: FieldDescription) -> None:
    one = Description("their_msgs/msg/Thing", (field,), ())
    with pytest.raises(ToolError):
        make_class(one._replace(uses=(one,)))


def test_arrays_of_messages_without_bytes_are_refused() -> None:
    empty = Description("their_msgs/msg/Empty", (), ())
    field = FieldDescription("x", 48 + 1, 1000, 0, "their_msgs/msg/Empty")
    with pytest.raises(ToolError, match="0 bytes"):
        make_class(Description("their_msgs/msg/Thing", (field,), (empty,)))
