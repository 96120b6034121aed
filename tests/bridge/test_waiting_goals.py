"""Goals of a node for an action server that is not there yet, in another process of the launch or elsewhere."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from tests.support.bridged_loop import launch_of
from tests.support.waiting import PATIENCE, wait_for

from chefbot.bridge import bridged_actions
from chefbot.bridge.bridged_actions import SERVER_UNREACHABLE, ActionClientBridge
from chefbot.bridge.ports import launch_ports
from chefbot.msgs.action_msgs import STATUS_CANCELED, STATUS_SUCCEEDED, CancelGoal_Request, GoalInfo
from chefbot.msgs.chefbot_msgs import Deliver, Deliver_Goal, Deliver_Result
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.ros2.rmw.action_client import new_goal_id
from chefbot.ros2.rmw.action_server import ActionServer
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.launch import Launch, NodeEntry


class Guest:
    """A client whose server may start later; `results` are (status, delivered places, error code)."""

    def __init__(self, node: RmwNode, action: str = "deliver", *, server_starts: bool = True) -> None:
        self.results: queue.Queue[tuple[int, tuple[str, ...], int]] = queue.Queue()
        self.bridge = ActionClientBridge(
            node, action, Deliver, self._take, lambda: 0, server_starts=server_starts
        )

    def _take(self, topic: str, message) -> None:
        if topic.endswith("/get_result"):
            self.results.put((message.status, message.result.delivered, message.result.error_code))

    def order(self, *places: str) -> UUID:
        goal_id = new_goal_id()
        self.bridge.forward("send_goal", Deliver.send_goal(goal_id, Deliver_Goal(places)))
        return goal_id

    def result(self) -> tuple[int, tuple[str, ...], int]:
        return self.results.get(timeout=PATIENCE)


@contextmanager
def cook(port: int) -> Iterator[list[str]]:
    """Serve the action in a session of its own; yield the places of the goals, in order of arrival."""
    arrived: list[str] = []
    made = threading.Event()

    def accept(goal_id: UUID, goal: Deliver_Goal) -> bool:
        arrived.extend(goal.places)
        assert made.wait(PATIENCE)  # goals wait already and arrive while the server is being made
        server.finish(goal_id, STATUS_SUCCEEDED, Deliver_Result(goal.places))
        return True

    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "cook") as node:
        server = ActionServer(node, "deliver", Deliver, accept, lambda _: False)
        made.set()
        yield arrived


@pytest.fixture
def node(port: int, monkeypatch: pytest.MonkeyPatch) -> Iterator[RmwNode]:
    monkeypatch.setattr(bridged_actions, "SERVER_TIMEOUT", 0.0)  # later than any process can start
    with RmwContext(port=port) as wire, RmwNode(wire, "guest") as one:
        yield one


def wait_beyond_the_timeout(node: RmwNode) -> None:
    """Return when goals without a server that were sent until now would have failed."""
    other = Guest(node, "nothing", server_starts=False)
    other.order("tea")
    assert other.result()[2] == SERVER_UNREACHABLE


def test_goals_wait_in_order_until_their_server_starts(node: RmwNode, port: int) -> None:
    guest = Guest(node)
    places = ("soup", "salad", "pie")
    for place in places:
        guest.order(place)
    wait_beyond_the_timeout(node)
    with cook(port) as arrived:
        results = [guest.result() for _ in places]
    assert sorted(results) == sorted((STATUS_SUCCEEDED, (place,), 0) for place in places)
    assert arrived == list(places)


def test_goals_fail_when_a_server_that_ran_is_gone(node: RmwNode, port: int) -> None:
    guest = Guest(node)
    guest.order("soup")
    with cook(port):
        assert guest.result()[0] == STATUS_SUCCEEDED
    wait_for(lambda: not guest.bridge._client.served)
    guest.order("salad")
    assert guest.result()[2] == SERVER_UNREACHABLE


def test_waiting_goals_can_be_cancelled_or_abandoned(node: RmwNode, port: int) -> None:
    guest, leaver = Guest(node), Guest(node)
    leaver.order("tea")
    leaver.bridge.close()
    unwanted = guest.order("soup")
    guest.bridge.forward("cancel_goal", CancelGoal_Request(GoalInfo(unwanted)))
    assert guest.result()[0] == STATUS_CANCELED
    guest.order("salad")
    with cook(port) as arrived:
        assert guest.result() == (STATUS_SUCCEEDED, ("salad",), 0)
    assert arrived == ["salad"] and leaver.results.empty()


def test_a_goal_that_cannot_be_sent_fails(node: RmwNode, port: int) -> None:
    guest = Guest(node)
    guest.order("soup", "half a surrogate \ud800")
    guest.order("salad")
    with cook(port) as arrived:
        results = [guest.result() for _ in range(2)]
    assert {code for _, _, code in results} == {0, SERVER_UNREACHABLE}
    assert arrived == ["salad"]


def test_actions_and_latched_topics_of_a_launch_are_remapped() -> None:
    remapped = NodeEntry(
        kind="tests.runtime.toys:Cook", remap={"deliver": "bring", "dishes": "cups"}, process="bar"
    )
    launch = Launch(
        name="two", description="", args={}, nodes={**launch_of(("cook", "guest")).nodes, "barista": remapped}
    )
    assert launch_ports(launch) == (frozenset({"dishes", "cups"}), frozenset({"deliver", "bring"}))
