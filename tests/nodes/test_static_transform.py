"""A fixed transform for display, repeated with the current time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.config import ConfigError
from chefbot.maths.se2 import SE2
from chefbot.nodes.static_transform import StaticTransformNode, StaticTransformParams

KIND = "chefbot.nodes.static_transform:StaticTransformNode"


def runner(**params: Any) -> NodeRunner:
    return NodeRunner({"map": KIND}, {}, {"map": params})


def test_the_transform_is_published_with_the_present_time() -> None:
    one = runner(frame="map", child="odom", x=1.0, y=-2.0, yaw=0.5)
    one.run(1.0)
    (first, *_), times = (
        one.messages("tf"),
        [message.transforms[0].header.stamp.ns for message in one.messages("tf")],
    )
    (transform,) = first.transforms
    assert (transform.header.frame_id, transform.child_frame_id) == ("map", "odom")
    assert (transform.transform.translation.x, transform.transform.translation.y) == (1.0, -2.0)
    assert transform.transform.rotation.yaw == pytest.approx(0.5)
    steps = {later - earlier for earlier, later in pairwise(times)}
    assert steps == {100_000_000} and len(times) >= 10
    assert one.messages("tf_static") == [], "/tf_static belongs to the robot's own frames"


def test_the_inverse_path_through_the_tree_is_the_inverse() -> None:
    one = runner(frame="map", child="odom", x=1.0, y=-2.0, yaw=0.5)
    one.run(0.2)
    there = one.system.transforms.lookup("odom", "map")
    assert tuple(there @ SE2(1.0, -2.0, 0.5)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        {"frame": ""},
        {"child": ""},
        {"x": 10_001.0},
        {"y": float("nan")},
        {"yaw": 7.1},
        {"z": 1.0},
        {"x": "1"},
    ],
)
def test_a_wrong_parameter_stops_the_start_with_its_name(wrong: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        runner(**({"frame": "map", "child": "odom"} | wrong))


def test_all_parameters_may_change_while_it_runs() -> None:
    one = runner(frame="map", child="odom")
    one.run(0.2)
    node = one.system.nodes["map"]
    assert isinstance(node, StaticTransformNode) and node.live_params == ("*",)
    node.reconfigure(StaticTransformParams(frame="map", child="odom", x=3.0))
    one.run(0.2)
    assert [message.transforms[0].transform.translation.x for message in one.messages("tf")][-1] == 3.0
