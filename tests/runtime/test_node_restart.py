"""Nodes that keep failing are restarted with their state; goals of lost nodes are aborted."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal, Deliver_Result
from chefbot.msgs.std_msgs import Empty, Float64, String
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import action_client, action_server
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import RESTARTED, Device, In, Node, NoParams, Out, every, restored, topic
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.node_restart import LOST_TOPIC, MAX_DELAY_NS, MIN_DELAY_NS, SERVER_LOST
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.runtime.replay import Replay
from tests.runtime.toys import Source

MS, SECOND = 1_000_000, 1_000_000_000


class Counter(Node):
    """Adds up in a published state, and fails from 10 to 13, at 500 to 650 ms, if `broken`."""

    params: NoParams
    count: In[Float64]
    restored_sum: In[Float64] = restored("sum")
    restarted: In[Empty] = restored(RESTARTED)
    sum: Out[Float64] = topic(latched=True)
    started: Out[String]
    error: type[Exception] = ZeroDivisionError

    def start(self) -> None:
        self._sum = 0.0
        self.started.publish(String("fresh"))

    def on_restored_sum(self, message: Float64) -> None:
        self._sum = message.data

    def on_restarted(self, _: Empty) -> None:
        self.started.publish(String(f"restarted with {self._sum:g}"))

    def on_count(self, message: Float64) -> None:
        if self.fails(message.data):
            raise self.error("it is that number again")
        self._sum += 1.0
        self.sum.publish(Float64(self._sum))

    def fails(self, count: float) -> bool:
        return 10 <= count < 13


class BrokenForEver(Counter):
    def fails(self, count: float) -> bool:
        return count >= 10


class BadInput(BrokenForEver):
    error = UserError


class BrokenDevice(Device):
    params: NoParams
    started: Out[String]

    def start(self) -> None:
        self.started.publish(String("fresh"))

    @every(hz=20)
    def tick(self) -> None:
        raise ZeroDivisionError


class Cook(Node):
    params: NoParams
    deliver = action_server(Deliver)

    async def on_deliver(self, goal: Deliver_Goal, _: object) -> Deliver_Result:
        await self.sleep(1000.0)
        return Deliver_Result(goal.places)


class Guest(Node):
    params: NoParams
    deliver = action_client(Deliver)
    got: Out[String]

    def start(self) -> None:
        self.spawn(self.order())

    async def order(self) -> None:
        result = await self.deliver.call(Deliver_Goal(("soup",)))
        self.got.publish(String(f"{result.error_code} {result.error_msg}"))


class Run:
    """A system with these nodes and a record of what is published."""

    def __init__(self, *kinds: type[Node], log: Path | None = None) -> None:
        self.system = NodeContainer(Loop(StepClock()), load_robot("chefbot"), 5)
        self.system.isolate_faults(lambda _: None)
        self.published: list[tuple[int, str, str]] = []
        self.recorder = Recorder(log, self.system.robot, 5) if log else None
        if self.recorder is not None:
            self.system.loop.add_observer(self.recorder)
        self.system.loop.add_observer(
            lambda item: (
                self.published.append((item.time_ns // MS, item.topic, item.message.data))
                if isinstance(item.message, String)
                else None
            )
        )
        entries = {kind.__name__.lower(): NodeEntry(kind=f"{__name__}:{kind.__name__}") for kind in kinds}
        self.system.launch(Launch(name="faulty", description="", args={}, nodes=entries))

    def until(self, seconds: float) -> Run:
        self.system.loop.run(until_ns=round(seconds * SECOND))
        return self

    def on(self, topic: str) -> list[tuple[int, str]]:
        return [(time, text) for time, name, text in self.published if name == topic]


def test_a_node_that_keeps_failing_is_restarted_with_its_state() -> None:
    run = Run(Source, Counter).until(3.0)
    restart = 600 + MIN_DELAY_NS // MS
    assert run.on("process_lost") == [(600, "counter")]  # the third exception
    assert run.on("started") == [(0, "fresh"), (restart, "fresh"), (restart, "restarted with 19")]
    assert run.on("process_back") == [(restart, "counter")]


def test_a_node_that_goes_on_failing_is_restarted_less_and_less() -> None:
    run = Run(Source, BrokenForEver).until(40.0)
    times = [time for time, _ in run.on("process_back")]
    pauses = [after - before for before, after in pairwise(times)]
    assert all(a < b for a, b in pairwise(pauses[:4]))
    assert pauses[-1] == pytest.approx(MAX_DELAY_NS // MS, abs=200)


@pytest.mark.parametrize("kind", [BadInput, BrokenDevice])
def test_bad_input_and_devices_cause_no_restart(kind: type[Node]) -> None:
    run = Run(Source, kind).until(3.0)
    assert run.on("started") == [(0, "fresh")] and not run.on("process_lost")


def test_the_goals_of_a_lost_node_are_aborted() -> None:
    run = Run(Cook, Guest).until(1.0)
    assert not run.on("got")
    run.system.loop.publish(LOST_TOPIC, String("cook"), "test", from_device=True)
    run.until(2.0)
    assert [text for _, text in run.on("got")] == [f"{SERVER_LOST} Node cook does not run any more."]


def test_a_replay_repeats_the_restarts(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    run = Run(Source, Counter, log=path).until(3.0)
    assert run.recorder is not None
    run.recorder.close()
    replay = Replay(read_log(path))
    replay.run()
    assert replay.differences == [] and replay.compared > 40
