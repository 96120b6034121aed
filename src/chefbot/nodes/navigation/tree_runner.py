"""Runs a behavior tree in a node: ticks, and the log of what changed."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.common import Status

from chefbot.behavior_tree.leaves import Pending
from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.behavior_tree.tree_log import TreeLog
from chefbot.msgs.chefbot_msgs import LocalizationStatus
from chefbot.msgs.nav2_msgs import BehaviorTreeLog
from chefbot.nodes.navigation.tree_services import TreeServicesNode
from chefbot.runtime.coroutines import Future, wait_any
from chefbot.runtime.node import Out

TICK_PERIOD = 0.1
"""Maximum time between two ticks of the tree, s; it is also ticked when something that it waits for is done."""


class TreeRunnerNode(TreeServicesNode):
    """Base class of a node that runs one behavior tree at a time."""

    behavior_tree_log: Out[BehaviorTreeLog]

    def start(self) -> None:
        """Start with no running behavior tree."""
        super().start()
        self._wake: Future[None] = Future()
        self._watched: list[Pending] = []

    async def _run(self, tree: BehaviorTree, prepare: Callable[[], None]) -> bool:
        """Tick a tree until it has ended; return whether it succeeded. `prepare` is called before each tick."""
        log = TreeLog(tree)
        while True:
            prepare()
            status = tree.tick(self.now_ns)
            self._publish_changes(log)
            if status is not Status.RUNNING:
                return status is Status.SUCCESS
            self._watch(tree.pending)
            self._wake = Future()
            await wait_any(self._wake, self.sleep(TICK_PERIOD))

    def _watch(self, pending: list[Pending]) -> None:
        """Wake the tree as soon as one of these is done."""
        for one in pending:
            if one not in self._watched:
                one.add_done_callback(lambda: self._wake.set_result(None))
        self._watched = pending

    def on_localization_status(self, status: LocalizationStatus) -> None:
        """Wake the tree when localization is lost."""
        super().on_localization_status(status)
        if self._localization.is_lost:
            self._wake.set_result(None)

    def _publish_changes(self, log: TreeLog) -> None:
        changes = log.changes(self.now_ns)
        if changes is not None:
            self.behavior_tree_log.publish(changes)
