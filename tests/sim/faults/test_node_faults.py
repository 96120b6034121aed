"""Tests faults of nodes and links: what a node misses, when it runs again, and that a replay is the same."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest

from chefbot.errors import UserError
from chefbot.msgs.std_msgs import Float64, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry, load_launch
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node import Device, In, Node, NoParams, Out, every, topic
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.runtime.replay import Replay
from chefbot.sim.faults import events as e
from chefbot.sim.faults.node_faults import KIND, NODE, fault_events, inject

HERE = "tests.sim.faults.test_node_faults"


class ClockDevice(Device):
    """Publishes the time at 10 Hz."""

    params: NoParams
    beat: Out[Float64]

    @every(hz=10)
    def tick(self) -> None:
        self.beat.publish(Float64(self.now_ns / 1e9))


class CounterNode(Node):
    """Repeats each beat, and counts its own timer, with the count latched."""

    params: NoParams
    beat: In[Float64]
    repeated: Out[Float64]
    count: Out[Float64] = topic("count", latched=True)

    def start(self) -> None:
        self._count = 0

    def on_beat(self, message: Float64) -> None:
        self.repeated.publish(message)

    @every(hz=4)
    def tick(self) -> None:
        self._count += 1
        self.count.publish(Float64(float(self._count)))


class ListenerNode(Node):
    """Publishes what reaches it."""

    params: NoParams
    count: In[Float64]
    repeated: In[Float64]
    received: Out[Float64]
    received_count: Out[Float64]

    def on_repeated(self, message: Float64) -> None:
        self.received.publish(message)

    def on_count(self, message: Float64) -> None:
        self.received_count.publish(message)


class NodeRun:
    """Device, counter and listener on a loop with fault events."""

    def __init__(self, *events: Any, record: Path | None = None) -> None:
        self.system = NodeContainer(Loop(StepClock()), load_robot("chefbot"), 1)
        self.loop = self.system.loop
        self.published: list[Publication] = []
        self.loop.add_observer(self.published.append)
        self.recorder = Recorder(record, self.system.robot, 1) if record else None
        if self.recorder:
            self.loop.add_observer(self.recorder)
        kinds = {"clock": "ClockDevice", "counter": "CounterNode", "listener": "ListenerNode"}
        nodes = {name: NodeEntry(kind=f"{HERE}:{kind}") for name, kind in kinds.items()}
        plain = [msgspec.to_builtins(event) for event in events]
        nodes[NODE] = NodeEntry(kind=KIND, params={"events": plain})
        self.system.launch(Launch(name="toys", description="", args={}, nodes=nodes))

    def run(self, until: float) -> NodeRun:
        self.loop.run(until_ns=round(until * 1e9))
        if self.recorder:
            self.recorder.close()
        return self

    def on(self, name: str) -> list[tuple[float, float]]:
        """Time and value of each message on a topic."""
        return [
            (round(item.time_ns / 1e9, 4), round(item.message.data, 4))  # type: ignore[attr-defined]
            for item in self.published
            if item.topic == name
        ]

    @property
    def notices(self) -> list[tuple[float, str]]:
        return [
            (item.time_ns / 1e9, item.message.data)  # type: ignore[attr-defined]
            for item in self.published
            if item.topic == "simulation/notice"
        ]


FAULTS: list[Any] = [
    e.NodeKilled(at=1.05, until=2.0, node="counter"),
    e.NodeHung(at=1.05, until=2.0, node="counter"),
    e.Slow(at=1.05, until=2.0, node="counter", seconds=0.25),
    e.Slow(at=1.05, until=2.0, link="counter", seconds=0.25),
    e.LinkCut(at=1.05, until=2.0, link="counter"),
    e.LinkBlackHole(at=1.05, until=2.0, link="counter"),
]


def label(event: Any) -> str:
    return f"{event.__struct_config__.tag}-{'link' if getattr(event, 'link', '') else 'node'}"


@pytest.mark.parametrize("event", FAULTS, ids=label)
def test_a_fault_begins_and_ends_and_leaves_all_else(event: Any) -> None:
    run, healthy = NodeRun(event).run(5.0), NodeRun().run(5.0)
    assert [time for time, _ in run.notices] == [1.05, 2.0]
    assert run.on("beat") == healthy.on("beat")
    assert run.on("received") != healthy.on("received")
    for name in ("repeated", "received"):
        assert [item for item in run.on(name) if item[0] < 1.05] == [
            item for item in healthy.on(name) if item[0] < 1.05
        ]
        assert [item for item in run.on(name) if item[0] > 2.5] == [
            item for item in healthy.on(name) if item[0] > 2.5
        ]


@pytest.mark.parametrize("event", FAULTS, ids=label)
def test_a_replay_with_a_fault_is_bit_identical(event: Any, tmp_path: Path) -> None:
    NodeRun(event, record=tmp_path / "run.mcap").run(4.0)
    replay = Replay(read_log(tmp_path / "run.mcap"))
    replay.run()
    assert replay.differences == [] and replay.compared > 60


def test_a_killed_node_is_silent_and_restarts() -> None:
    run = NodeRun(FAULTS[0]).run(3.1)
    assert not [time for time, _ in run.on("repeated") if 1.05 <= time <= 2.0]
    assert [value for time, value in run.on("count") if time > 2.0][:2] == [1.0, 2.0]


def test_a_node_that_is_killed_for_good_stays_dead() -> None:
    run = NodeRun(e.NodeKilled(at=1.05, node="counter")).run(5.0)
    assert run.on("count")[-1][0] == 1.0 and len(run.notices) == 1


def test_a_hung_node_catches_up_with_the_last_ten_messages() -> None:
    run = NodeRun(e.NodeHung(at=1.05, until=3.02, node="counter")).run(4.0)
    caught_up = [value for time, value in run.on("repeated") if time == 3.02]
    assert caught_up == [round(2.1 + i / 10, 1) for i in range(10)]
    assert [time for time, _ in run.on("count") if time > 1.05][:3] == [3.02, 3.25, 3.5], (
        "timers stay in phase"
    )


def test_a_slow_node_handles_one_message_after_the_other() -> None:
    run = NodeRun(e.Slow(at=1.05, until=4.0, node="counter", seconds=0.25)).run(5.0)
    by_counter = [item.time_ns / 1e9 for item in run.published if item.publisher == "counter"]
    during = [time for time in by_counter if 1.05 <= time < 4.0]
    gaps = [round(b - a, 4) for a, b in pairwise(during)]
    assert during and set(gaps) == {0.25}


def test_a_slow_link_delivers_everything_later() -> None:
    run = NodeRun(e.Slow(at=1.05, until=3.0, link="counter", seconds=0.25)).run(5.0)
    late = {round(time - value, 4) for time, value in run.on("received") if 1.7 < time < 3.0}
    assert late == {0.5}, "from the device to the node, and from the node to the listener"


def test_after_a_cut_the_last_latched_message_follows() -> None:
    cut, lost = (
        NodeRun(kind(at=1.05, until=1.9, link="counter")).run(3.0) for kind in (e.LinkCut, e.LinkBlackHole)
    )
    assert [(t, v) for t, v in cut.on("received_count") if 1.05 < t < 2.0] == [(1.9, 7.0)]
    assert not [t for t, _ in lost.on("received_count") if 1.05 < t < 2.0]


def test_a_link_fault_of_one_topic_leaves_the_others() -> None:
    run = NodeRun(e.LinkBlackHole(at=1.05, until=2.0, link="counter", topics=("count",))).run(3.0)
    assert not [t for t, _ in run.on("received_count") if 1.05 < t < 2.0]
    assert len([t for t, _ in run.on("received") if 1.05 < t < 2.0]) == 9


def test_an_operator_hangs_and_frees_a_node() -> None:
    run = NodeRun().run(1.05)
    run.loop.publish("simulation/fault", String("hung counter"), "test", from_device=True)
    run.run(2.05)
    assert run.on("repeated")[-1][0] == 1.0
    run.loop.publish("simulation/fault", String("none counter"), "test", from_device=True)
    run.run(2.1)
    assert run.on("repeated")[-1] == (2.1, 2.1)
    assert [text for _, text in run.notices] == [
        "Fault begins: hung of counter.",
        "Fault ends: hung of counter.",
    ]


def test_two_faults_of_one_node_at_once_are_refused() -> None:
    run = NodeRun(FAULTS[0], e.NodeHung(at=1.5, until=1.8, node="counter")).run(3.0)
    assert "Fault impossible: hung of counter: node counter is killed" in run.notices[1][1]


# -- a launch with events

EVENTS = [
    e.NodeHung(at=5.0, until=6.0, node="planner"),
    e.SensorFreeze(at=3.0, until=4.0, sensor="lidar"),
    e.Bump(at=4.0),
]


def test_a_launch_carries_its_events() -> None:
    launch = inject(load_launch("explore", {"headless": "true"}), EVENTS)
    again = Launch.from_json(launch.to_json())
    assert fault_events(again) == sorted(EVENTS, key=lambda event: event.at)
    assert [item["fault"] for item in launch.nodes["simulator"].params["events"]] == ["freeze", "bump"]


@pytest.mark.parametrize("name", ["plannr", "simulator", NODE])
def test_a_node_that_cannot_fail_is_refused(name: str) -> None:
    with pytest.raises(UserError, match=f"no node '{name}' can fail"):
        inject(load_launch("explore"), [e.NodeKilled(at=1.0, node=name)])


def test_events_need_a_simulator() -> None:
    with pytest.raises(UserError, match="simulated robot only"):
        inject(load_launch("robot_standalone"), EVENTS)
