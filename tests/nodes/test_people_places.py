"""Where a node knows people to be: in its own frame, and only as long as the tracker reports them."""

from __future__ import annotations

from typing import Any

import pytest
from tests.support.nodes import NodeRunner

from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs.people import TrackedPeople, TrackedPerson
from chefbot.msgs.geometry_msgs import Point, TransformStamped
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.nodes.people.places import PeoplePlacesNode
from chefbot.people.people_messages import TRACKED_PEOPLE_TIMEOUT_NS
from chefbot.runtime.node import NoParams, every


class OnTheMap(PeoplePlacesNode):
    """A node that knows people in the frame of the map."""

    params: NoParams
    fixed_frame = "map"

    @every(hz=10)
    def pass_time(self) -> None:
        """Let the clock go on."""


def node_with_a_person(frame: str) -> tuple[NodeRunner, Any]:
    """Return a node whose map lies 2 m behind odometry and a quarter turn to its left; person 7 is at (1, 0)."""
    runner = NodeRunner({"node": f"{__name__}:OnTheMap"}, {}, {})
    transform = TransformStamped.of(0, "map", "odom", SE2(2.0, 0.0, 1.5707963267948966))
    runner.loop.publish("tf_static", TFMessage((transform,)), "test", from_device=True)
    people = TrackedPeople(Header.of(runner.loop.now_ns, frame), (TrackedPerson(7, Point(1.0, 0.0)),))
    runner.loop.publish("tracked_people", people, "test", from_device=True)
    runner.run(0.1)
    return runner, runner.system.nodes["node"]


@pytest.mark.parametrize(("frame", "place"), [("map", (1.0, 0.0)), ("odom", (2.0, 1.0))])
def test_places_are_in_the_frame_of_the_node(frame: str, place: tuple[float, float]) -> None:
    numbers, places = node_with_a_person(frame)[1]._people()
    assert numbers.tolist() == [7] and places[0].tolist() == pytest.approx(place)


def test_without_a_transform_nobody_is_known() -> None:
    assert not len(node_with_a_person("elsewhere")[1]._people()[0])


def test_an_old_message_places_nobody() -> None:
    runner, node = node_with_a_person("map")
    runner.run(TRACKED_PEOPLE_TIMEOUT_NS / 1e9 + 0.2)
    assert not len(node._people()[0])
