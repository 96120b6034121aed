"""The explorer begins and ends on request of an operator, and not while the emergency stop is active."""

from __future__ import annotations

from tests.support.nodes import NodeRunner

from chefbot.msgs.std_msgs import Bool
from chefbot.nodes.explorer import READY, STOPPED

EXPLORER = {"explorer": "chefbot.nodes.explorer:ExplorerNode"}


def waiting_explorer() -> NodeRunner:
    runner = NodeRunner(EXPLORER, {}, {"explorer": {"autostart": False}})
    runner.run(0.5)
    return runner


def order(runner: NodeRunner, topic: str, value: bool) -> str:
    """Publish an order; the sentence of the newest status."""
    runner.loop.publish(topic, Bool(value), "page")
    runner.run(0.5)
    return str(runner.messages("exploration_status")[-1].description)


def turns(runner: NodeRunner) -> int:
    """The number of full turns that were begun: an exploration begins with one."""
    return len(runner.messages("spin/_action/send_goal"))


def test_it_waits_for_an_order() -> None:
    runner = waiting_explorer()
    (status,) = runner.messages("exploration_status")
    assert (status.done, status.description) == (True, READY) and turns(runner) == 0


def test_it_is_begun_ended_and_begun_again() -> None:
    runner = waiting_explorer()
    order(runner, "explore", True)
    order(runner, "explore", True)
    assert turns(runner) == 1, "a second order changes nothing"
    assert order(runner, "explore", False) == "Exploration was cancelled."
    order(runner, "explore", True)
    assert turns(runner) == 2


def test_the_emergency_stop_refuses_it() -> None:
    runner = waiting_explorer()
    order(runner, "emergency_stop", True)
    assert order(runner, "explore", True) == STOPPED and turns(runner) == 0
    assert order(runner, "emergency_stop", False) == READY
    order(runner, "explore", True)
    assert turns(runner) == 1
