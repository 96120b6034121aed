"""The log of a behavior tree: replayed, it gives the statuses of the tree."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from tests.support.scripted_trees import run, scripted

from chefbot.behavior_tree.tree_log import TreeLog

BODY = (
    '<PipelineSequence name="drive"><RateController hz="2"><Leaf name="plan" script="{}"/></RateController>'
    '<RecoveryNode><Leaf name="follow" script="{}"/><Leaf name="recover" script="{}"/></RecoveryNode>'
    "</PipelineSequence>"
)
SCRIPTS = st.text("SFR", min_size=1, max_size=6)


@given(SCRIPTS, SCRIPTS, SCRIPTS, st.integers(1, 12))
def test_the_changes_lead_to_the_present_statuses(plan: str, follow: str, recover: str, ticks: int) -> None:
    tree = scripted(BODY.format(plan, follow, recover))
    log, statuses = TreeLog(tree), ["IDLE"] * len(tree.states())
    for k in range(ticks):
        now_ns = k * 100_000_000
        tree.tick(now_ns)
        changes = log.changes(now_ns)
        for event in changes.event_log if changes else ():
            assert statuses[event.uid - 1] == event.previous_status != event.current_status
            assert event.node_name == tree.states()[event.uid - 1].name and event.timestamp.ns == now_ns
            statuses[event.uid - 1] = event.current_status
        assert statuses == [state.status.upper() for state in tree.states()]
    assert log.changes(0) is None, "nothing has changed since"


def test_unchanged_statuses_are_not_logged() -> None:
    tree = scripted('<Sequence><Leaf script="R"/></Sequence>')
    log = TreeLog(tree)
    run(tree, 1)
    assert log.changes(0) is not None
    run(tree, 3)
    assert log.changes(1) is None
