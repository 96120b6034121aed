"""Tests of the node that tracks people: its topics, its launches, and messages that it cannot use."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from tests.people.scene import PERIOD, legs, ranges_of, scan_of
from tests.support.nodes import NodeRunner

from chefbot.demo.processes import split_into_processes
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.diagnostic_msgs import OK, WARN
from chefbot.msgs.geometry_msgs import TransformStamped
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.validity import check
from chefbot.people.people_messages import predict_person
from chefbot.runtime.launch import built_in_launches, load_launch

TOPICS = ("people", "people/poses", "tracked_people")
KIND = "chefbot.nodes.people_tracker:PeopleTrackerNode"
SPEED = 0.8
SECOND = 1_000_000_000


class Watch(NodeRunner):
    """The node with a lidar at the origin of odom, and a person who walks past."""

    def __init__(self) -> None:
        super().__init__({"people_tracker": KIND}, {})
        transform = TransformStamped.of(0, "odom", "laser", IDENTITY)
        self.loop.publish("tf_static", TFMessage((transform,)), "test")
        self.run(0.001)

    @property
    def x(self) -> float:
        return -2.0 + SPEED * self.loop.now_ns / SECOND

    def scan(self, frame: str = "laser", age: float = 0.0) -> LaserScan:
        stamp = self.loop.now_ns - round(age * SECOND)
        scan = scan_of(ranges_of(legs(self.x, 1.5, 0.0)))
        return msgspec.structs.replace(scan, header=Header.of(stamp, frame))

    def walk(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.loop.publish("scan", self.scan(), "test")
            self.run(PERIOD)

    def warnings(self) -> list[str]:
        found = [message.status[0] for message in self.messages("diagnostics")]
        assert all(status.level == (OK if "tracked." in status.message else WARN) for status in found)
        return [status.message for status in found if status.level == WARN]


@pytest.fixture(scope="module")
def watched() -> Watch:
    watch = Watch()
    watch.walk(3.0)
    return watch


def last(watch: Watch, topic: str) -> Any:
    return watch.messages(topic)[-1]


def test_a_person_is_published_on_all_topics(watched: Watch) -> None:
    (person,), (tracked,) = last(watched, "people").people, last(watched, "tracked_people").people
    (pose,) = last(watched, "people/poses").poses
    assert person.name == str(tracked.id) == "1"
    assert person.position == tracked.position
    assert (pose.position.x, pose.position.y) == (tracked.position.x, tracked.position.y)
    assert math.hypot(tracked.position.x - (watched.x - SPEED * PERIOD), tracked.position.y - 1.5) < 0.1
    assert pose.se2.yaw == pytest.approx(0.0, abs=0.2)
    assert tracked.velocity.x == pytest.approx(SPEED, abs=0.2)
    assert tracked.visible and not tracked.standing
    assert len({len(watched.messages(topic)) for topic in TOPICS}) == 1


@pytest.mark.parametrize("topic", TOPICS)
def test_messages_are_valid_and_encoded_without_loss(watched: Watch, topic: str) -> None:
    for message in watched.messages(topic):
        check(message)  # raises
        assert type(message).from_cdr(message.to_cdr()).to_cdr() == message.to_cdr()
        assert message.header.frame_id == "odom"


def test_a_person_is_predicted_with_growing_doubt(watched: Watch) -> None:
    (person,) = last(watched, "tracked_people").people
    now, later = (predict_person(person, seconds, 0.8) for seconds in (0.0, 2.0))
    assert later.x - now.x == pytest.approx(2.0 * person.velocity.x)
    assert later.deviation > 2.0 * now.deviation
    standing = predict_person(msgspec.structs.replace(person, standing=True), 2.0, 0.8)
    assert (standing.x, standing.y) == (person.position.x, person.position.y)


def test_scans_in_unknown_frames_and_old_ones_change_nothing() -> None:
    watch = Watch()
    watch.walk(3.0)
    before = len(watch.messages("tracked_people"))
    watch.loop.publish("scan", watch.scan(frame="moon"), "test")
    watch.loop.publish("scan", watch.scan(age=2.0), "test")
    watch.run(1.0)
    assert len(watch.messages("tracked_people")) == before
    assert len(watch.warnings()) == 1
    assert "older" in watch.warnings()[0]
    watch.walk(1.0)
    assert [person.id for person in last(watch, "tracked_people").people] == [1]


def test_the_map_is_used_where_odom_is_known_in_it() -> None:
    watch = Watch()
    transform = TransformStamped.of(0, "map", "odom", SE2(1.0, 2.0, 0.3))
    watch.loop.publish("tf_static", TFMessage((transform,)), "test")
    watch.walk(3.0)
    assert len(last(watch, "people").people) == 1


def test_every_launch_that_navigates_tracks_people() -> None:
    for name in built_in_launches():
        nodes = load_launch(name).nodes
        if "navigator" in nodes:
            assert nodes["people_tracker"].kind == KIND
            assert nodes["people_tracker"].process == nodes["controller"].process
            split = split_into_processes(load_launch(name)).nodes
            assert split["people_tracker"].process == split["controller"].process == "navigation"
