"""Order, time, tasks, actions."""

from __future__ import annotations

import threading
from time import sleep

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.config import ConfigError
from chefbot.msgs.chefbot_msgs import Deliver_Goal
from chefbot.msgs.std_msgs import Float64, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import PacedClock, StepClock, WallClock
from chefbot.runtime.coroutines import Cancelled
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import DEVICE, MESSAGE, TIMER, Loop
from chefbot.runtime.node_container import NodeContainer
from tests.support.waiting import PATIENCE

HERE = "tests.runtime.toys"
HOUR = 3_600_000_000_000


def make(nodes: dict[str, str], seed: int = 1, start_ns: int = 0) -> NodeContainer:
    system = NodeContainer(Loop(StepClock(), start_ns), load_robot("chefbot"), seed)
    entries = {name: NodeEntry(kind=f"{HERE}:{kind}") for name, kind in nodes.items()}
    system.launch(Launch(name="test", description="", args={}, nodes=entries))
    return system


@given(st.lists(st.tuples(st.integers(0, 3), st.sampled_from([DEVICE, MESSAGE, TIMER])), max_size=30))
def test_events_happen_by_time_then_rank_then_sequence(events: list[tuple[int, int]]) -> None:
    loop = Loop(StepClock())
    seen: list[tuple[int, int, int]] = []
    for i, (time, rank) in enumerate(events):
        loop.schedule(time, rank, lambda key=(time, rank, i): seen.append(key))
    loop.run()
    assert seen == sorted(seen) and len(seen) == len(events)


def test_messages_run_before_timers_of_the_same_instant() -> None:
    loop = Loop(StepClock())
    seen: list[str] = []
    loop.subscribe("a", "first", lambda m: loop.publish("b", m, "first"))
    loop.subscribe("b", "second", lambda _: seen.append("b"))
    loop.schedule(5, TIMER, lambda: seen.append("timer"))
    loop.schedule(5, DEVICE, lambda: loop.publish("a", String("x"), "device"))
    loop.run()
    assert seen == ["b", "timer"]


def run_elsewhere(loop: Loop) -> bool:
    """Run the loop in a thread; return whether that ended."""
    thread = threading.Thread(target=loop.run, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    return not thread.is_alive()


def test_a_loop_that_was_stopped_before_it_runs_returns() -> None:
    """A signal, or the death of the service manager, may come before."""
    loop, seen = Loop(WallClock(), 0), list[str]()
    loop.schedule(HOUR, TIMER, lambda: seen.append("timer"))
    loop.stop()
    assert run_elsewhere(loop) and not seen
    loop.run(until=lambda: True)
    loop.stop()
    assert run_elsewhere(loop), "a run that has ended by itself does not forget the stop behind it"


def test_a_stop_just_before_the_loop_waits_is_not_lost() -> None:
    class Interrupted(WallClock):
        """Another thread stops the loop while it schedules a posted action, due in an hour."""

        def read(self, reached_ns: int) -> int:
            loop.stop()
            return reached_ns + HOUR

    loop = Loop(Interrupted(), 0)
    loop.post(lambda: None)
    assert run_elsewhere(loop)


def test_a_stopped_loop_can_run_again() -> None:
    loop, seen = Loop(StepClock()), list[int]()
    for time in (1, 2):
        loop.schedule(time, TIMER, lambda time=time: (seen.append(time), loop.stop()))
    loop.run()
    assert seen == [1]
    loop.run()
    assert seen == [1, 2]


def test_an_isolated_action_is_timed_as_the_calling_callback() -> None:
    """So is what it requests in turn; the callback that runs the actions is not charged for them."""
    loop, waiting = Loop(StepClock()), []

    def request(_: object, work: int = 2) -> None:
        waiting.append(loop.isolated(lambda _: (sleep(0.02), request(None, work - 1) if work else None)))

    def serve(_: object) -> None:
        while waiting:
            waiting.pop()(None)

    loop.subscribe("a", "client", request)
    loop.subscribe("b", "server", serve)
    for topic in ("a", "b"):
        loop.publish(topic, String(""), "test")
    loop.run()
    client, server = loop.timings["client <- a"], loop.timings["server <- b"]
    assert (client.calls, server.calls) == (1, 1)
    assert client.total_ns >= 0.06e9 and 0 < server.total_ns < 0.5 * client.total_ns
    assert 0.02e9 <= client.worst_ns < client.total_ns


def test_callbacks_posted_by_threads_get_unique_times() -> None:
    loop = Loop(PacedClock(100.0))
    seen: list[int] = []
    loop.schedule(10**9, TIMER, lambda: None)
    threads = [threading.Thread(target=lambda: loop.post(lambda: seen.append(loop.now_ns))) for _ in range(4)]
    for thread in threads:
        thread.start()
    loop.run()
    for thread in threads:
        thread.join()
    assert len(seen) == 4 and all(time > 0 for time in seen)


def test_the_same_seed_repeats_the_publications_another_differs() -> None:
    def run(seed: int) -> list[tuple[str, int, bytes]]:
        system = make({"counter": "Counter", "doubler": "Doubler", "dice": "Dice"}, seed)
        out: list[tuple[str, int, bytes]] = []
        system.loop.add_observer(lambda p: out.append((p.topic, p.time_ns, p.message.to_cdr())))
        system.loop.run(until_ns=3 * 10**9)
        return out

    assert run(1) == run(1)
    assert run(1) != run(2)


def test_latched_messages_reach_late_subscribers_until_shutdown() -> None:
    system = make({"cook": "Cook", "guest": "Guest"})
    system.loop.run(until_ns=3 * 10**9)
    received: list[str] = []
    system.loop.subscribe("dishes", "late", lambda m: received.append(m.data))
    system.loop.run(until_ns=3 * 10**9 + 1)
    assert received == ["salad"]
    system.stop()
    system.loop.subscribe("dishes", "later", lambda m: received.append(m.data))
    system.loop.run(until_ns=4 * 10**9)
    assert received == ["salad"]


def test_an_action_runs_in_loop_time_and_returns_its_result() -> None:
    system = make({"cook": "Cook", "guest": "Guest"})
    system.loop.run(until_ns=1_500_000_000)
    assert system.nodes["guest"].results == []
    system.loop.run(until_ns=2_500_000_000)
    assert system.nodes["guest"].results[0].delivered == ("soup", "salad")


def test_a_new_goal_preempts_the_old_one() -> None:
    system = make({"cook": "Cook", "guest": "Guest"})
    guest = system.nodes["guest"]
    system.loop.run(until_ns=500_000_000)
    second = guest.deliver.call(Deliver_Goal(("cake",)))
    system.loop.run(until_ns=3 * 10**9)
    assert second.result().delivered == ("cake",)
    with pytest.raises(Cancelled):
        guest.task.result()


def test_cancelling_a_client_cancels_its_pending_goal() -> None:
    system = make({"cook": "Cook", "guest": "Guest"})
    dishes: list[str] = []
    system.loop.subscribe("dishes", "test", lambda m: dishes.append(m.data))
    system.loop.run(until_ns=1_500_000_000)
    system.nodes["guest"].task.cancel()
    system.loop.run(until_ns=5 * 10**9)
    assert dishes == ["soup"]
    assert not system.nodes["cook"].deliver.busy


def test_a_stopped_node_is_silent() -> None:
    system = make({"counter": "Counter", "doubler": "Doubler"})
    received: list[Float64] = []
    system.loop.subscribe("double", "test", received.append)
    system.loop.run(until_ns=10**9)
    count = len(received)
    system.stop()
    system.loop.run(until_ns=2 * 10**9)
    assert count == 10 and len(received) == count


def test_devices_in_the_next_launch_keep_running() -> None:
    system = make({"counter": "Counter", "doubler": "Doubler"})
    counter, doubler = system.nodes["counter"], system.nodes["doubler"]
    system.loop.run(until_ns=10**9)
    entries = {name: NodeEntry(kind=f"{HERE}:{name.title()}") for name in ("counter", "doubler")}
    system.launch(Launch(name="next", description="", args={}, nodes=entries))
    assert system.nodes["counter"] is counter
    assert system.nodes["doubler"] is not doubler


def test_a_faulty_launch_starts_nothing() -> None:
    system = make({"counter": "Counter"})
    counter = system.nodes["counter"]
    bad = {"counter": NodeEntry(kind=f"{HERE}:Counter", params={"stpe": 2.0})}
    with pytest.raises(ConfigError, match=r"unknown key 'stpe' \(did you mean 'step'\?\)"):
        system.launch(Launch(name="bad", description="", args={}, nodes=bad))
    assert system.nodes["counter"] is counter
