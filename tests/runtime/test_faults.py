"""Exceptions of nodes: each costs one callback, is counted and reported; a node that keeps failing does not drive."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal, Deliver_Result
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray
from chefbot.msgs.geometry_msgs import TransformStamped, Twist
from chefbot.msgs.std_msgs import Float64, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.load import load_robot
from chefbot.runtime.actions import SERVER_EXCEPTION, action_client, action_server
from chefbot.runtime.callback_faults import FAULT_WINDOW_NS, Fault, status_of
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import Device, In, Node, NoParams, Out, every
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.runtime.replay import Replay
from tests.runtime.toys import Source

MS = 1_000_000


class Clumsy(Node):
    """Cannot bear counts from 10 to 14, and drives on."""

    params: NoParams
    count: In[Float64]
    cmd_vel: Out[Twist]
    forwarded: Out[Float64]

    def on_count(self, message: Float64) -> None:
        if 10 <= message.data < 15:
            raise ZeroDivisionError("it is that number again")
        self.forwarded.publish(message)

    @every(hz=20)
    def drive(self) -> None:
        self.cmd_vel.publish(Twist.of(0.1, 0.0))


class BurntCook(Node):
    params: NoParams
    deliver = action_server(Deliver)

    async def on_deliver(self, goal: Deliver_Goal, _: object) -> Deliver_Result:
        await self.sleep(0.1)
        if goal.places == ("soup",):
            raise KeyError("salt")
        return Deliver_Result(goal.places)


class Guest(Node):
    params: NoParams
    deliver = action_client(Deliver)
    got: Out[String]

    def start(self) -> None:
        self.spawn(self.order())

    async def order(self) -> None:
        for dish in ("soup", "salad"):
            result = await self.deliver.call(Deliver_Goal((dish,)))
            self.got.publish(String(f"{dish} {result.error_code} {result.error_msg}"))


class Quitter(Device):
    params: NoParams

    def start(self) -> None:
        self.post(self._give_up)

    def _give_up(self) -> None:
        raise UserError("the device is gone")


def system_of() -> NodeContainer:
    return NodeContainer(Loop(StepClock()), load_robot("chefbot"), 5)


def launch_of(*kinds: type[Node]) -> Launch:
    entries = {kind.__name__.lower(): NodeEntry(kind=f"{__name__}:{kind.__name__}") for kind in kinds}
    return Launch(name="faulty", description="", args={}, nodes=entries)


@pytest.fixture
def isolated() -> Iterator[tuple[NodeContainer, list[Fault]]]:
    system, new = system_of(), list[Fault]()
    system.isolate_faults(new.append)
    yield system, new
    system.stop()


def messages_on(system: NodeContainer, topic: str) -> list[tuple[int, object]]:
    messages: list[tuple[int, object]] = []
    system.loop.subscribe(topic, "", lambda message: messages.append((system.loop.now_ns, message)))
    return messages


def test_an_exception_costs_one_message_and_is_reported(isolated: tuple[NodeContainer, list[Fault]]) -> None:
    system, new = isolated
    forwarded, reports = messages_on(system, "forwarded"), messages_on(system, "diagnostics")
    system.launch(launch_of(Source, Clumsy))
    system.loop.run(until_ns=3_000 * MS)
    assert len(forwarded) == 60 - 5
    assert [one.sentence for one in new] == ["clumsy <- count: ZeroDivisionError: it is that number again"]
    assert system.faults is not None and system.faults.bug_count == 5
    last = reports[-1][1]
    assert isinstance(last, DiagnosticArray)
    assert (last.status[0].level, last.status[0].values[0].value) == (ERROR, "5")
    assert len(reports) == 2  # at once, and a second later with what had come until then


def test_a_node_that_keeps_failing_is_stopped(isolated: tuple[NodeContainer, list[Fault]]) -> None:
    """Counts 10 to 14 come from 0.5 to 0.7 s: the third fault silences, until a second after the third last."""
    system, _ = isolated
    driven = messages_on(system, "cmd_vel")
    system.launch(launch_of(Source, Clumsy))
    system.loop.run(until_ns=3_000 * MS)
    times = [time // MS for time, _ in driven]
    assert times == [*range(50, 600, 50), *range(600 + FAULT_WINDOW_NS // MS + 50, 3_001, 50)]


def test_without_isolation_the_first_fault_ends_the_run() -> None:
    system = system_of()
    system.launch(launch_of(Source, Clumsy))
    with pytest.raises(ZeroDivisionError):
        system.loop.run(until_ns=3_000 * MS)


def test_a_goal_whose_server_fails_gets_an_answer(isolated: tuple[NodeContainer, list[Fault]]) -> None:
    system, new = isolated
    got = messages_on(system, "got")
    system.launch(launch_of(BurntCook, Guest))
    system.loop.run(until_ns=1_000 * MS)
    assert [message.data for _, message in got] == [
        f"soup {SERVER_EXCEPTION} deliver failed: 'salt'",
        "salad 0 ",
    ]  # type: ignore[attr-defined]
    assert [one.callback for one in new] == ["burntcook.sleep"]


def test_transform_callbacks_run_although_others_raise(
    isolated: tuple[NodeContainer, list[Fault]],
) -> None:
    system, new = isolated
    served: list[SE2] = []

    def fail(_: SE2) -> None:
        raise IndexError("out of the map")

    system.loop.subscribe("go", "first", lambda _: system.transforms.on_available("odom", "base", 0, fail))
    system.loop.subscribe(
        "go", "second", lambda _: system.transforms.on_available("odom", "base", 0, served.append)
    )
    system.loop.publish("go", String("go"), "test")
    transform = TransformStamped.of(0, "odom", "base", SE2(1.0, 2.0, 0.0))
    system.loop.publish("tf", TFMessage((transform,)), "test")
    system.loop.run(until_ns=1)
    assert served == [SE2(1.0, 2.0, 0.0)]
    assert [one.callback for one in new] == ["first <- go"]


def test_a_run_with_faults_replays_bit_identically(
    isolated: tuple[NodeContainer, list[Fault]], tmp_path: Path
) -> None:
    system, _ = isolated
    recorder = Recorder(tmp_path / "run.mcap", system.robot, 5)
    system.loop.add_observer(recorder)
    system.launch(launch_of(Source, Clumsy, BurntCook, Guest))
    system.loop.run(until_ns=3_000 * MS)
    recorder.close()
    replay = Replay(read_log(tmp_path / "run.mcap"))
    replay.run()
    assert replay.differences == []
    assert system.faults is not None and replay.faults.counts == system.faults.counts


def test_a_failing_device_ends_the_run(isolated: tuple[NodeContainer, list[Fault]]) -> None:
    system, _ = isolated
    system.launch(launch_of(Quitter))
    with pytest.raises(UserError, match="the device is gone"):
        system.loop.run(until_ns=1_000 * MS)


def test_the_status_names_the_main_fault() -> None:
    status = status_of({"slam <- scan: TypeError: a": 2, "base <- odom: KeyError: b": 5})
    assert status.message == "7 callbacks of nodes failed, mainly base <- odom: KeyError: b"
    assert [value.value for value in status.values] == ["2", "5"] and status.level == ERROR
    assert status_of({}).message == "0 callbacks of nodes failed" and status_of({}).level == OK
