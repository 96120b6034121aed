"""A node that runs a behavior tree: when it ticks, what it publishes, and how it ends."""

from __future__ import annotations

from typing import Any

import pytest
from py_trees.common import Status
from tests.support.nodes import NodeRunner
from tests.support.scripted_trees import CATALOG

from chefbot.behavior.recovery import NavigatorParams
from chefbot.behavior_tree.blackboard import BehaviorTreeError, NodePort, NodePorts
from chefbot.behavior_tree.bt_xml import build_tree, read_tree_file
from chefbot.behavior_tree.catalog import NodeKind, NodeType
from chefbot.behavior_tree.leaves import ActionLeaf
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.nodes.navigation.tree_runner import TICK_PERIOD, TreeRunnerNode
from chefbot.runtime.coroutines import Future


class Await(ActionLeaf):
    """An action that ends when a test sets its future."""

    futures: list[Future[object]]

    def begin(self) -> Future[object]:
        future: Future[object] = Future()
        self.futures.append(future)
        return future

    def finish(self, result: object) -> Status:
        return Status.SUCCESS if result else Status.FAILURE


class Runner(TreeRunnerNode):
    """Runs the trees of a test, and notes the times of its ticks."""

    params: NavigatorParams

    def start(self) -> None:
        super().start()
        self.ticks: list[float] = []
        self.results: list[bool] = []

    def run_tree(self, tree: BehaviorTree) -> None:
        self.spawn(self._note_result(tree))

    async def _note_result(self, tree: BehaviorTree) -> None:
        self.results.append(await self._run(tree, lambda: self.ticks.append(self.now_ns / 1e9)))


class Running(NodeRunner):
    """A node that runs one tree of a body of XML; `futures` are those of its actions."""

    def __init__(self, body: str) -> None:
        super().__init__({"runner": f"{__name__}:Runner"}, {})
        self.node: Any = self.system.nodes["runner"]
        self.futures: list[Future[object]] = []

        def make(name: str, ports: NodePorts) -> Await:
            leaf = Await(name, ports)
            leaf.futures = self.futures
            return leaf

        text = f'<root BTCPP_format="4"><BehaviorTree ID="T">{body}</BehaviorTree></root>'
        catalog = {**CATALOG, "Await": NodeType(NodeKind.ACTION, make, (NodePort("for", str, default=""),))}
        self.tree = build_tree(read_tree_file(text.encode(), "t.xml"), catalog)
        self.run(0.0)
        self.node.run_tree(self.tree)

    def end(self, result: object) -> None:
        self.futures[-1].set_result(result)
        self.run(0.0)


@pytest.mark.parametrize(("script", "result"), [("S", True), ("F", False)])
def test_a_tree_that_ends_at_once_is_ticked_once(script: str, result: bool) -> None:
    running = Running(f'<Leaf script="{script}"/>')
    assert running.node.results == [result] and running.node.ticks == [0.0]


def test_a_tree_is_ticked_at_its_period_until_it_ends() -> None:
    running = Running('<Leaf script="RRRRS"/>')
    running.run(3.0)
    assert running.node.results == [True]
    assert running.node.ticks == pytest.approx([k * TICK_PERIOD for k in range(5)])


def test_an_action_that_is_done_wakes_the_tree_at_once() -> None:
    running = Running("<Sequence><Await/><Await/></Sequence>")
    running.run(0.23)
    running.end(True)
    assert running.node.ticks == pytest.approx([0.0, 0.1, 0.2, 0.23])
    assert len(running.futures) == 2, "the next action has begun"
    running.run(0.1)
    running.end(False)
    assert running.node.results == [False]
    ticks = len(running.node.ticks)
    running.run(1.0)
    assert len(running.node.ticks) == ticks


def test_an_action_of_long_ago_wakes_no_other_tree() -> None:
    running = Running('<Timeout msec="150"><Await/></Timeout>')
    running.run(1.0)
    assert running.node.results == [False]
    running.node.run_tree(running.tree)
    count = len(running.node.ticks)
    running.futures[0].set_result(True)
    running.run(0.05)
    assert len(running.node.ticks) <= count + 1 and running.node.results == [False]


def test_a_lost_localization_wakes_the_tree() -> None:
    running = Running("<Await/>")
    running.run(0.04)
    count = len(running.node.ticks)
    running.loop.publish("localization_status", LocalizationStatus(localized=True), "amcl")
    running.run(0.0)
    assert len(running.node.ticks) == count
    running.loop.publish("localization_status", LocalizationStatus(localized=False), "amcl")
    running.run(0.0)
    assert len(running.node.ticks) == count + 1


def test_only_changes_of_statuses_are_published() -> None:
    running = Running('<Sequence><Leaf name="a" script="RRS"/><Leaf name="b" script="RS"/></Sequence>')
    running.run(1.0)
    logs = running.messages("behavior_tree_log")
    changes = [
        [(one.node_name, one.previous_status, one.current_status) for one in log.event_log] for log in logs
    ]
    assert changes == [
        [("Sequence", "IDLE", "RUNNING"), ("a", "IDLE", "RUNNING")],
        [("a", "RUNNING", "SUCCESS"), ("b", "IDLE", "RUNNING")],
        [("Sequence", "RUNNING", "SUCCESS"), ("b", "RUNNING", "SUCCESS")],
    ]
    assert [log.timestamp.ns for log in logs] == [0, 200_000_000, 300_000_000]


def test_a_tree_that_cannot_run_fails_its_task() -> None:
    running = Running("<Leaf/>")
    text = '<root BTCPP_format="4"><BehaviorTree ID="T"><Leaf script="{nothing}"/></BehaviorTree></root>'
    tree = build_tree(read_tree_file(text.encode(), "t.xml"), CATALOG)
    with pytest.raises(BehaviorTreeError, match="the blackboard has no 'nothing'"):
        running.node.run_tree(tree)
    assert running.node.results == [True]
