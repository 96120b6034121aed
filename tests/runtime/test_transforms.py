"""Transforms of other publishers: those with a wrong stamp or too many frames do no harm to the rest."""

from __future__ import annotations

import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import MAX_FUTURE_NS
from chefbot.robot.load import load_robot
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import DEVICE, Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.transform_buffer import (
    CACHE_TIME_NS,
    FUTURE_TOLERANCE_NS,
    MAX_FRAMES,
    TransformBuffer,
    TransformError,
)

SECOND = 1_000_000_000


def moved(stamp_ns: int, x: float, child: str = "base_footprint") -> TFMessage:
    return TFMessage((TransformStamped.of(stamp_ns, "odom", child, SE2(x, 0.0, 0.0)),))


def system_that_receives(messages: list[tuple[int, str, Message]]) -> tuple[NodeContainer, list[Fault]]:
    system, faults = NodeContainer(Loop(StepClock()), load_robot("chefbot"), 1), list[Fault]()
    system.isolate_faults(faults.append)
    for time_ns, topic, message in messages:
        system.loop.schedule(time_ns, DEVICE, lambda t=topic, m=message: system.loop.publish(t, m, "test"))  # type: ignore[misc]
    system.loop.run()
    return system, faults


@pytest.mark.parametrize("ahead", [FUTURE_TOLERANCE_NS + 1, MAX_FUTURE_NS - 1, 3600 * SECOND])
def test_a_transform_from_the_future_is_refused(ahead: int) -> None:
    late = moved(SECOND + ahead, 99.0)
    system, faults = system_that_receives(
        [(SECOND, "tf", moved(SECOND, 1.0)), (SECOND, "tf", late), (2 * SECOND, "tf", moved(2 * SECOND, 2.0))]
    )
    assert system.transforms.lookup("odom", "base_footprint").x == 2.0
    assert ["ahead of the robot's clock" in one.sentence for one in faults] == [True]


def test_the_wrong_clock_is_named_where_another_frame_shows_it() -> None:
    tree = TransformBuffer()
    with pytest.raises(
        TransformError, match=r"odom -> base_footprint .* 3 s ahead .* publisher or this one is wrong"
    ):
        tree.add_transforms(moved(4 * SECOND, 1.0), False, SECOND)
    tree.add_transforms(moved(SECOND, 1.0, "door"), False, SECOND)
    with pytest.raises(TransformError, match="the clock of its publisher is wrong"):
        tree.add_transforms(moved(4 * SECOND, 1.0), False, SECOND)
    tree.add_transforms(moved(SECOND + FUTURE_TOLERANCE_NS, 2.0), False, SECOND)
    assert tree.newest_stamp("odom", "base_footprint") == SECOND + FUTURE_TOLERANCE_NS


def test_a_localization_may_post_date_its_transform() -> None:
    tree = TransformBuffer()
    later = TransformStamped.of(2 * SECOND, "map", "odom", SE2(5.0, 0.0, 0.0))
    tree.add_transforms(TFMessage((later,)), False, SECOND)
    assert tree.lookup("map", "odom").x == 5.0
    with pytest.raises(TransformError, match="map -> odom"):
        tree.add_transforms(TFMessage((later,)), False, -SECOND)


def test_a_static_frame_can_be_corrected_at_any_stamp() -> None:
    """A fixed transform holds at all times: its stamp does not count."""
    messages = [
        (SECOND, "tf_static", moved(3600 * SECOND, 1.0)),
        (2 * SECOND, "tf_static", moved(SECOND, 2.0)),
    ]
    system, faults = system_that_receives(messages)
    assert (system.transforms.lookup("odom", "base_footprint").x, faults) == (2.0, [])


def test_frames_beyond_the_maximum_number_are_refused() -> None:
    tree = TransformBuffer()
    for number in range(MAX_FRAMES):
        tree.add_transforms(moved(0, float(number), f"frame_{number}"), static=False)
    with pytest.raises(TransformError, match="1000 frames already; one_more is left out"):
        tree.add_transforms(moved(0, 0.0, "one_more"), static=False)
    tree.add_transforms(moved(1, 7.0, "frame_3"), static=False)
    assert tree.lookup("odom", "frame_3").x == 7.0


def test_cycles_and_reparented_static_frames_are_refused() -> None:
    tree = TransformBuffer()

    def add(parent: str, child: str, static: bool) -> None:
        tree.add_transforms(TFMessage((TransformStamped.of(0, parent, child, SE2(1.0, 0.0, 0.0)),)), static)

    add("odom", "base", False)
    add("base", "laser", True)
    for parent, child, static, reason in (
        ("laser", "odom", False, "laser hangs below odom"),
        ("kitchen", "laser", True, "laser is fixed to base"),
        ("base", "laser", False, "laser is fixed, it cannot become moving"),
        ("odom", "base", True, "base is moving, it cannot become fixed"),
    ):
        with pytest.raises(TransformError, match=reason):
            add(parent, child, static)
    assert tree.lookup("odom", "laser").x == 2.0


def test_the_valid_part_of_a_message_is_applied() -> None:
    tree = TransformBuffer()
    tree.add_transforms(moved(0, 1.0), static=True)
    good = TransformStamped.of(0, "odom", "other", SE2(3.0, 0.0, 0.0))
    bad = TransformStamped.of(0, "odom", "base_footprint", SE2(9.0, 0.0, 0.0))
    with pytest.raises(TransformError):
        tree.add_transforms(TFMessage((bad, good)), static=False)
    assert (tree.lookup("odom", "other").x, tree.lookup("odom", "base_footprint").x) == (3.0, 1.0)


def test_an_older_transform_is_inserted_between_its_neighbours() -> None:
    """Two publishers of one frame, or a network, may change the order of transforms."""
    tree = TransformBuffer()
    for second, x in ((1, 1.0), (3, 3.0), (2, 5.0)):
        tree.add_transforms(moved(second * SECOND, x), static=False)
    at = [tree.lookup("odom", "base_footprint", round(s * SECOND)).x for s in (1.0, 1.5, 2.0, 2.5, 3.0)]
    assert at == [1.0, 3.0, 5.0, 4.0, 3.0]
    assert tree.lookup("odom", "base_footprint").x == 3.0, "the latest is the one of the latest stamp"
    tree.add_transforms(moved(2 * SECOND, 7.0), static=False)
    assert tree.lookup("odom", "base_footprint", 2 * SECOND).x == 7.0


def test_a_transform_before_the_history_is_dropped() -> None:
    tree = TransformBuffer()
    for stamp_ns in (CACHE_TIME_NS + SECOND, CACHE_TIME_NS, SECOND, SECOND - 1):
        tree.add_transforms(moved(stamp_ns, stamp_ns / SECOND), static=False)
    assert tree.lookup("odom", "base_footprint", SECOND).x == 1.0
    with pytest.raises(TransformError, match="not known yet"):
        tree.lookup("odom", "base_footprint", SECOND - 1)
