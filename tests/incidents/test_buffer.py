"""The buffer of an incident: a minute, and what was known at its begin."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chefbot.incidents.buffer import IncidentBuffer
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.std_msgs import Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.runtime.loop import Publication

SECOND = 1_000_000_000
SPAN = 10 * SECOND


def published(
    topic: str, time_ns: int, message: Message | None = None, publisher: str = "node"
) -> Publication:
    return Publication(topic, message or String(str(time_ns)), publisher, False, time_ns, False)


def kept(*publications: Publication) -> list[Publication]:
    buffer = IncidentBuffer(SPAN)
    for publication in publications:
        buffer(publication)
    return buffer.content()


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 40 * SECOND)), min_size=1, max_size=60))
def test_it_keeps_the_span_and_the_last_message_before(events: list[tuple[str, int]]) -> None:
    everything = [published(topic, time_ns) for topic, time_ns in sorted(events, key=lambda event: event[1])]
    end = everything[-1].time_ns
    content = kept(*everything)
    recent = [one for one in everything if one.time_ns >= end - SPAN]
    assert content[len(content) - len(recent) :] == recent
    before = content[: len(content) - len(recent)]
    assert all(one.time_ns == end - SPAN for one in before), "known at the begin"
    for topic in "abc":
        older = [one for one in everything if one.topic == topic and one.time_ns < end - SPAN]
        known = [one.message for one in before if one.topic == topic]
        assert known == [one.message for one in older[-1:]]


def test_two_publishers_of_a_topic_are_kept_apart() -> None:
    content = kept(
        published("a", 0, publisher="one"), published("a", 1, publisher="two"), published("b", 3 * SPAN)
    )
    assert [one.publisher for one in content] == ["one", "two", "node"]


def test_transforms_of_other_frames_replace_nothing() -> None:
    def fixed(child: str, time_ns: int) -> Publication:
        stamped = TransformStamped.of(time_ns, "base_link", child, IDENTITY)
        return published("tf_static", time_ns, TFMessage((stamped,)))

    first, camera, laser = fixed("laser", 0), fixed("camera", 1), fixed("laser", 2)
    content = kept(first, camera, laser, published("b", 3 * SPAN))
    assert [one.message for one in content[:-1]] == [camera.message, laser.message]


def test_of_large_messages_it_keeps_a_part_and_the_newest() -> None:
    grid = Grid(np.zeros((2, 2), np.int8), 0.05, 0.0, 0.0)
    maps = [published("map", n * SECOND, OccupancyGrid.of(Header(), grid)) for n in range(10)]
    assert [one.time_ns // SECOND for one in kept(*maps)] == [0, 5, 9]
    assert [one.time_ns // SECOND for one in kept(*maps[:6])] == [0, 5]


def test_an_empty_buffer_has_no_content() -> None:
    assert kept() == []
