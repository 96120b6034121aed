"""Constraints on message contents, generated functions and rounding to the serialized precision."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.msgs.geometry_msgs import Point, Quaternion
from chefbot.msgs.idl.codegen import FunctionSource
from chefbot.msgs.idl.constraints import covariance, max_length, ordered, same_length, within
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.precision import float32_fields, rounding
from chefbot.msgs.rmw_dds_common import Gid, NodeEntitiesInfo, ParticipantEntitiesInfo
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.service_msgs import ServiceEventInfo
from chefbot.msgs.validity import check

FLOATS = st.floats(allow_nan=True, allow_infinity=True)


def fields(**values: Any) -> Any:
    return SimpleNamespace(**values)


@given(FLOATS)
def test_within_accepts_exactly_the_closed_interval(value: float) -> None:
    assert (within(-1.0, 2.0, "a")(fields(a=value)) == "") == (-1.0 <= value <= 2.0)


@given(FLOATS, FLOATS)
def test_ordered_needs_the_first_not_greater(low: float, high: float) -> None:
    found = ordered("low", "high")(fields(low=low, high=high))
    assert (found == "") == (low <= high) and (not found or found.startswith("low"))


@given(st.integers(0, 4), st.integers(0, 4))
def test_lengths_must_agree_or_be_empty(first: int, second: int) -> None:
    message = fields(a=[0] * first, b=[0] * second)
    assert (same_length("a", "b")(message) == "") == (first == second)
    assert (same_length("a", "b", may_be_empty=True)(message) == "") == (second in (0, first))
    assert (max_length(2, "a", "b")(message) == "") == (max(first, second) <= 2)


@given(st.integers(0, 2**32 - 1))
def test_true_covariances_pass_and_impossible_ones_do_not(seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(3, 3))
    matrix = root @ root.T
    check = covariance("c", 3)
    assert check(fields(c=matrix.reshape(9))) == ""
    wrong = matrix.copy()
    wrong[0, 1] = wrong[1, 0] = 1.01 * math.sqrt(matrix[0, 0] * matrix[1, 1]) + 1e-3
    assert check(fields(c=wrong.reshape(9)))
    wrong = matrix.copy()
    wrong[2, 2] = -1.0
    assert check(fields(c=wrong.reshape(9)))
    unknown = np.array([-1.0, *[5.0] * 8])
    assert covariance("c", 3, may_be_unknown=True)(fields(c=unknown)) == "" and check(fields(c=unknown))


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e9])
def test_every_coordinate_of_a_point_is_bounded(value: float) -> None:
    for name in ("x", "y", "z"):
        with pytest.raises(InvalidMessageError, match=f"^{name} is "):
            check(Point(**{name: value}))


@given(st.floats(-3.0, 3.0))
def test_a_rotation_must_be_a_unit_quaternion(angle: float) -> None:
    turn = Quaternion(0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))
    assert all(rule(turn) == "" for rule in Quaternion.RULES)
    long = Quaternion(0.0, 0.0, 1.1 * turn.z, 1.1 * turn.w)
    assert any(rule(long) for rule in Quaternion.RULES)


def test_a_generated_function_refers_to_given_objects() -> None:
    source = FunctionSource("def f(x):", offset=10)
    table = source.name({1: "one"})
    source.add(f"if x in {table}: return {table}[x]", "return x + offset")
    function = source.compile()
    assert (function(1), function(5)) == ("one", 15)


@given(st.floats(allow_nan=False, width=64, min_value=-1e30, max_value=1e30))
def test_rounding_equals_the_conversion_to_float32(value: float) -> None:
    assert "angle_min" in float32_fields(LaserScan)
    scan = LaserScan(angle_min=value, ranges=[value, 1])  # type: ignore[arg-type]
    assert scan.angle_min == float(np.float32(value))
    assert isinstance(scan.ranges, np.ndarray) and scan.ranges.dtype == np.float32
    assert rounding(Point) is None, "float64 fields need no rounding"


@given(st.binary(min_size=16, max_size=16), st.lists(st.text("abc", max_size=5), max_size=3))
def test_discovery_and_service_events_round_trip(gid: bytes, names: list[str]) -> None:
    identifier = Gid(np.frombuffer(gid, np.uint8))
    nodes = tuple(NodeEntitiesInfo("/", name, (identifier,), ()) for name in names)
    info = ParticipantEntitiesInfo(identifier, nodes)
    back = ParticipantEntitiesInfo.from_cdr(info.to_cdr())
    assert [one.node_name for one in back.node_entities_info_seq] == names
    assert back.gid.data.tobytes() == gid
    event = ServiceEventInfo(2, client_gid=identifier.data, sequence_number=-5)
    again = ServiceEventInfo.from_cdr(event.to_cdr())
    assert (again.event_type, again.client_gid.tobytes(), again.sequence_number) == (2, gid, -5)
