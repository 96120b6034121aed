"""Parameter values of every type, from plain values and back."""

from __future__ import annotations

import pytest

from chefbot.msgs import rcl_interfaces as rcl
from chefbot.ros2.tools.common import ToolError
from chefbot.ros2.tools.remote_parameters import plain_to_parameter


@pytest.mark.parametrize(
    ("kind", "plain"),
    [
        (rcl.BOOL, True), (rcl.INTEGER, -3), (rcl.DOUBLE, 1.5), (rcl.STRING, "a"), (rcl.BYTE_ARRAY, [1, 2]),
        (rcl.BOOL_ARRAY, [True, False]), (rcl.INTEGER_ARRAY, [1, -1]), (rcl.DOUBLE_ARRAY, [0.5, 1]),
        (rcl.STRING_ARRAY, ["a", "b"]), (rcl.STRING_ARRAY, []),
    ],
)  # fmt: skip
def test_parameter_values_of_every_type_round_trip(kind: int, plain: object) -> None:
    value = rcl.ParameterValue.from_cdr(plain_to_parameter(kind, plain, "x").to_cdr())
    assert value.type == kind and value.plain == plain


@pytest.mark.parametrize("kind", [rcl.NOT_SET, rcl.STRING_ARRAY + 1, 255])
def test_parameter_values_of_no_known_type_are_not_set(kind: int) -> None:
    assert rcl.ParameterValue(kind, string_value="a").plain is None


@pytest.mark.parametrize(
    ("kind", "plain"),
    [(rcl.BOOL, 1), (rcl.INTEGER, True), (rcl.INTEGER, 1.5), (rcl.DOUBLE, "a"), (rcl.STRING, 1), (rcl.DOUBLE, [1.0]),
     (rcl.STRING_ARRAY, "ab"), (rcl.INTEGER_ARRAY, [True])],
)  # fmt: skip
def test_parameter_values_of_a_wrong_type_are_refused(kind: int, plain: object) -> None:
    with pytest.raises(ToolError, match="is of type"):
        plain_to_parameter(kind, plain, "x")
