"""Tests the waiting callbacks of a node that hangs or is slow: their order, their times, and what is dropped."""

from __future__ import annotations

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.runtime.clock import StepClock
from chefbot.runtime.loop import DEVICE, MESSAGE, TIMER, Loop, ScheduledEvent
from chefbot.sim.faults.callback_queue import QUEUE_DEPTH, CallbackQueue

SECOND = 1_000_000_000
NODE = "slow"


class OneNode:
    """A loop in which the callbacks of one node are intercepted; `ran` are their names and times, s."""

    def __init__(self, seconds: float | None) -> None:
        self.loop = Loop(StepClock())
        self.queue: CallbackQueue | None = CallbackQueue(
            self.loop, None if seconds is None else round(seconds * SECOND)
        )
        self.loop.interceptor = self  # type: ignore[assignment]
        self.ran: list[tuple[str, float]] = []
        self.messages = {topic: self.loop.timing(NODE, topic) for topic in ("a", "b")}

    def intercept(self, event: ScheduledEvent, rank: int) -> bool:
        return self.queue is not None and event.timing.owner == NODE and self.queue.intercept(event, rank)

    def call(self, at: float, name: str, topic: str = "a", rank: int = MESSAGE) -> ScheduledEvent:
        return self.loop.schedule(
            round(at * SECOND),
            rank,
            lambda: self.ran.append((name, self.loop.now_ns / SECOND)),
            self.messages[topic],
        )

    def release(self, at: float) -> None:
        """End the fault, as an event of another node."""

        def end() -> None:
            queue, self.queue = self.queue, None
            assert queue is not None
            queue.release()

        self.loop.schedule(round(at * SECOND), DEVICE, end)

    def names(self) -> list[str]:
        return [name for name, _ in self.ran]


def test_nothing_runs_until_a_hang_ends() -> None:
    node = OneNode(None)
    for k in range(3):
        node.call(1.0 + k, f"message {k}")
    node.loop.run(until_ns=20 * SECOND)
    assert node.ran == []
    node.release(25.0)
    node.loop.run()
    assert node.ran == [(f"message {k}", 25.0) for k in range(3)]


def test_of_each_topic_the_newest_messages_wait_and_all_timers() -> None:
    node = OneNode(None)
    for k in range(QUEUE_DEPTH + 5):
        node.call(1.0 + 0.01 * k, f"a{k}")
        node.call(1.0 + 0.01 * k, f"timer {k}", rank=TIMER)
    node.call(1.0, "b0", topic="b")
    node.release(5.0)
    node.loop.run()
    assert [name for name in node.names() if name[0] == "a"] == [f"a{k}" for k in range(5, QUEUE_DEPTH + 5)]
    assert "b0" in node.names(), "messages of other topics do not drop it"
    assert sum(name.startswith("timer") for name in node.names()) == QUEUE_DEPTH + 5


@settings(max_examples=40)
@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=9), st.floats(0.01, 1.0))
def test_a_slow_node_runs_one_after_the_other_in_order(times: list[float], seconds: float) -> None:
    node = OneNode(seconds)
    due = sorted(times)
    for k, at in enumerate(due):
        node.call(at, str(k))
    node.loop.run()
    assert node.names() == [str(k) for k in range(len(due))]
    end = 0.0
    for (_, ran), at in zip(node.ran, due, strict=True):
        end = max(end, at) + seconds
        assert ran == pytest.approx(end, abs=1e-6)


@settings(max_examples=60)
@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=9), st.floats(0.01, 1.0), st.floats(0.0, 5.0))
def test_when_a_fault_ends_no_callback_overtakes_another(
    times: list[float], seconds: float, end: float
) -> None:
    assume(min(abs(at - end) for at in times) > 1e-6)
    node = OneNode(seconds)
    for k, at in enumerate(sorted(times)):
        node.call(at, str(k))
    node.release(end)
    node.loop.run()
    assert node.names() == [str(k) for k in range(len(times))]
    assert all(ran <= max(end, at) + 1e-6 for (_, ran), at in zip(node.ran, sorted(times), strict=True))


def test_a_cancelled_callback_takes_no_time() -> None:
    node = OneNode(1.0)
    first, _, _ = (node.call(0.0, name) for name in "abc")
    node.loop.schedule(SECOND // 2, DEVICE, first.cancel)
    node.call(0.6, "d")
    node.loop.run()
    assert node.ran == [("b", 1.6), ("c", 2.6), ("d", 3.6)]


def test_callbacks_cancelled_while_they_waited_do_not_run() -> None:
    node = OneNode(None)
    events = [node.call(0.0, name) for name in "abc"]
    node.loop.schedule(SECOND, DEVICE, events[1].cancel)
    node.release(2.0)
    node.loop.run()
    assert node.names() == ["a", "c"]
