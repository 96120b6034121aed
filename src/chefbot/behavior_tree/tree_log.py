"""The changes of a behavior tree between two ticks, as Nav2 publishes them."""

from __future__ import annotations

from chefbot.behavior_tree.tree import BehaviorTree
from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.nav2_msgs import BehaviorTreeLog, BehaviorTreeStatusChange

IDLE = "idle"


class TreeLog:
    """Compares the statuses of the nodes of one tree with those of the tick before."""

    def __init__(self, tree: BehaviorTree) -> None:
        self._tree = tree
        self._statuses = [IDLE] * len(tree.states())

    def changes(self, now_ns: int) -> BehaviorTreeLog | None:
        """Return what has changed, or None."""
        states, stamp = self._tree.states(), Time.of(now_ns)
        events = tuple(
            BehaviorTreeStatusChange(stamp, state.name, uid, before.upper(), state.status.upper())
            for uid, (before, state) in enumerate(zip(self._statuses, states, strict=True), start=1)
            if before != state.status
        )
        self._statuses = [state.status for state in states]
        return BehaviorTreeLog(stamp, events) if events else None
