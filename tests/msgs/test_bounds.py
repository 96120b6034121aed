"""Every field of every message has bounds: numbers, arrays, strings; what lies beyond is refused by its name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from chefbot.msgs.geometry_msgs import PoseStamped, PoseWithCovariance
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.fields import NUMPY_TYPES, MessageField, fields_of
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import MAX_WAYPOINTS, NavigateThroughPoses_Goal
from chefbot.msgs.nav_msgs import Goals, MapMetaData, OccupancyGrid
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.validity import MAX_ABS_VALUE, MAX_NUMBERS, MAY_BE_NAN, check, max_length_of
from tests.support.messages import all_messages

MAP = OccupancyGrid(info=MapMetaData(resolution=0.05))


def all_types() -> list[type[Message]]:
    """Return all message types of the package."""
    return sorted(all_messages(), key=lambda kind: (kind.__module__, kind.__name__))


def too_long(kind: type[Message], field: MessageField) -> Any:
    """Return a value that is one element longer than allowed."""
    n = max_length_of(kind, field) + 1
    if field.message is not None:
        return (field.message(),) * n
    if field.element == "string":
        return ("",) * n if field.is_array else "a" * n
    return np.broadcast_to(np.zeros((), NUMPY_TYPES[field.element]), n)  # takes no memory


def values_beyond(kind: type[Message], field: MessageField) -> list[Any]:
    """Return values that no message may have; none for booleans, nested messages and integers of any value."""
    if (field.is_array and not field.fixed_size) or (field.element == "string" and not field.is_array):
        return [too_long(kind, field)]
    if field.is_array and field.element.startswith("float"):
        return [np.full(field.fixed_size, bad) for bad in (np.nan, np.inf, 2.0 * MAX_ABS_VALUE)]
    if field.message is not None or field.is_array:
        return []
    low, high = kind.BOUNDS.get(field.name, (-MAX_ABS_VALUE, MAX_ABS_VALUE))
    if field.element.startswith("float"):
        unknown = [] if kind in MAY_BE_NAN else [math.nan, math.inf, -math.inf]
        return [*unknown, high + abs(high) + 1.0, low - abs(low) - 1.0]
    limits = np.iinfo(NUMPY_TYPES[field.element]) if field.element != "bool" else None
    beyond = [] if limits is None or field.name not in kind.BOUNDS else [int(high) + 1, int(low) - 1]
    return [value for value in beyond if limits is not None and limits.min <= value <= limits.max]


@pytest.mark.parametrize("kind", all_types(), ids=lambda kind: kind.__name__)
def test_what_lies_beyond_the_bounds_is_refused(kind: type[Message]) -> None:
    message = MAP if kind is OccupancyGrid else kind()
    for field in fields_of(kind):
        for value in values_beyond(kind, field):
            with pytest.raises(InvalidMessageError, match=f"^{field.name}"):
                check(replace(message, **{field.name: value}))


@pytest.mark.parametrize("kind", [kind for kind in all_types() if kind.BOUNDS or kind.MAX_LENGTHS])
def test_bounds_belong_to_fields_and_include_the_default(kind: type[Message]) -> None:
    names = {field.name for field in fields_of(kind)}
    assert set(kind.BOUNDS) | set(kind.MAX_LENGTHS) <= names
    for name, (low, high) in kind.BOUNDS.items():
        default = getattr(kind(), name)
        assert low < high
        assert (
            low <= default <= high
            or math.isnan(default)
            or (kind.__name__, name) == ("MapMetaData", "resolution")
        )


def test_nearly_all_arrays_are_bounded_by_their_meaning() -> None:
    beams = LaserScan(ranges=np.zeros(MAX_NUMBERS // 2, np.float32))
    with pytest.raises(InvalidMessageError, match=r"^ranges has 500000 elements, at most 100000 can be used"):
        check(beams)


def test_a_goal_has_no_more_poses_than_a_feedback_can_report() -> None:
    check(NavigateThroughPoses_Goal(Goals(goals=(PoseStamped(),) * MAX_WAYPOINTS)))
    with pytest.raises(InvalidMessageError, match="poses has 1001 elements, at most 1000 can be used"):
        check(NavigateThroughPoses_Goal(Goals(goals=(PoseStamped(),) * (MAX_WAYPOINTS + 1))))


def correlated(*pairs: tuple[int, int, float]) -> PoseWithCovariance:
    """Return a pose whose variances are 1 and whose other covariances are given."""
    matrix = np.eye(6)
    for row, column, value in pairs:
        matrix[row, column] = value
    return PoseWithCovariance(covariance=matrix.reshape(36))


def test_a_covariance_is_symmetric_and_positive_semidefinite() -> None:
    check(correlated((0, 1, 0.5), (1, 0, 0.5)))
    check(correlated((0, 1, 1.0), (1, 0, 1.0)))
    with pytest.raises(InvalidMessageError, match=r"^covariance is not symmetric"):
        check(correlated((0, 1, 0.5)))
    each = [(0, 1, 0.9), (1, 0, 0.9), (1, 2, 0.9), (2, 1, 0.9), (0, 2, -0.9), (2, 0, -0.9)]
    with pytest.raises(InvalidMessageError, match=r"^covariance is not positive semidefinite"):
        check(correlated(*each))


def test_covariances_of_very_different_units_pass() -> None:
    sigma = np.array([1e-6, 1e3, 0.0, 1.0, 0.0, 1e6])
    root = np.tril(np.random.default_rng(3).normal(size=(6, 6)))
    root /= np.linalg.norm(root, axis=1, keepdims=True)
    check(PoseWithCovariance(covariance=(np.outer(sigma, sigma) * (root @ root.T)).reshape(36)))
