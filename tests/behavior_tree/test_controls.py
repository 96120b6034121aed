"""Control nodes and decorators: the statuses they return, and what they tick and stop."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.scripted_trees import leaf, run, scripted

SCRIPTS = st.text("SFR", min_size=1, max_size=6)


def test_a_pipeline_ticks_again_what_has_succeeded() -> None:
    tree = scripted(
        '<PipelineSequence><Leaf name="plan" script="S"/><Leaf name="follow" script="RRRS"/></PipelineSequence>'
    )
    assert run(tree, 4) == "RRRS"
    assert leaf(tree, "plan").ticks == leaf(tree, "follow").ticks == 4


def test_a_pipeline_goes_on_while_an_earlier_child_runs_again() -> None:
    tree = scripted(
        '<PipelineSequence><Leaf name="plan" script="SRRS"/><Leaf name="follow" script="RRRS"/></PipelineSequence>'
    )
    assert run(tree, 4) == "RRRS"
    assert leaf(tree, "follow").ticks == 4


def test_a_pipeline_that_fails_stops_what_runs() -> None:
    tree = scripted(
        '<PipelineSequence><Leaf name="plan" script="SF"/><Leaf name="follow" script="R"/></PipelineSequence>'
    )
    assert run(tree, 2) == "RF"
    assert leaf(tree, "follow").stops == 1 and leaf(tree, "follow").ticks == 1


def test_a_recovery_node_recovers_as_often_as_it_may() -> None:
    body = '<RecoveryNode number_of_retries="2"><Leaf name="main" script="F"/><Leaf name="recovery"/></RecoveryNode>'
    tree = scripted(body)
    assert run(tree, 1) == "F"
    assert (leaf(tree, "main").ticks, leaf(tree, "recovery").ticks) == (3, 2)
    run(tree, 1)
    assert leaf(tree, "main").ticks == 6, "it counts from zero again"


def test_a_recovery_that_fails_ends_the_recovery_node() -> None:
    tree = scripted(
        '<RecoveryNode number_of_retries="5"><Leaf name="main" script="F"/><Leaf script="RF"/></RecoveryNode>'
    )
    assert run(tree, 2) == "RF"
    assert leaf(tree, "main").ticks == 1


def test_a_round_robin_gives_each_child_its_turn() -> None:
    tree = scripted(
        '<RecoveryNode number_of_retries="4"><Leaf name="main" script="F"/>'
        '<RoundRobin><Leaf name="a"/><Leaf name="b" script="F"/><Leaf name="c"/></RoundRobin></RecoveryNode>'
    )
    assert run(tree, 1) == "F"
    assert [leaf(tree, name).ticks for name in "abc"] == [2, 2, 2], "b fails, so c has its turn at once"


def test_a_reactive_sequence_stops_when_its_guard_fails() -> None:
    tree = scripted(
        '<ReactiveSequence><Leaf name="guard" script="SSF"/><Leaf name="work" script="R"/></ReactiveSequence>'
    )
    assert run(tree, 3) == "RRF"
    assert leaf(tree, "work").stops == 1


def test_a_reactive_fallback_stops_lower_priorities() -> None:
    tree = scripted(
        '<ReactiveFallback><Leaf name="done" script="FFS"/><Leaf name="work" script="R"/></ReactiveFallback>'
    )
    assert run(tree, 3) == "RRS"
    assert leaf(tree, "work").stops == 1


@given(SCRIPTS)
def test_decorators_change_the_status_as_their_names_promise(script: str) -> None:
    plain = run(scripted(f'<Leaf script="{script}"/>'), 6)
    inverted = run(scripted(f'<Inverter><Leaf script="{script}"/></Inverter>'), 6)
    assert inverted == plain.translate(str.maketrans("SF", "FS"))
    assert run(scripted(f'<ForceSuccess><Leaf script="{script}"/></ForceSuccess>'), 6) == plain.replace(
        "F", "S"
    )
    assert run(scripted(f'<ForceFailure><Leaf script="{script}"/></ForceFailure>'), 6) == plain.replace(
        "S", "F"
    )


@pytest.mark.parametrize(
    ("body", "ticks", "expected", "leaf_ticks"),
    [
        ('<Repeat num_cycles="3"><Leaf name="x"/></Repeat>', 3, "RRS", 3),
        ('<Repeat num_cycles="3"><Leaf name="x" script="SF"/></Repeat>', 2, "RF", 2),
        ('<RetryUntilSuccessful num_attempts="2"><Leaf name="x" script="F"/></RetryUntilSuccessful>', 2, "RF", 2),
        ('<RetryUntilSuccessful num_attempts="9"><Leaf name="x" script="FFS"/></RetryUntilSuccessful>', 3, "RRS", 3),
        ('<KeepRunningUntilFailure><Leaf name="x" script="SSF"/></KeepRunningUntilFailure>', 3, "RRF", 3),
        ('<Timeout msec="250"><Leaf name="x" script="R"/></Timeout>', 4, "RRRF", 4),
        ('<Delay delay_msec="250"><Leaf name="x"/></Delay>', 4, "RRRS", 1),
        ('<SingleTrigger><Leaf name="x"/></SingleTrigger>', 3, "SFF", 1),
        ('<Parallel success_count="2"><Leaf name="x" script="RS"/><Leaf script="RRS"/><Leaf script="R"/></Parallel>',
         3, "RRS", 2),
        ('<Parallel><Leaf name="x" script="R"/><Leaf script="RF"/></Parallel>', 2, "RF", 2),
    ],
)  # fmt: skip
def test_decorators_over_time(body: str, ticks: int, expected: str, leaf_ticks: int) -> None:
    tree = scripted(body)
    assert run(tree, ticks) == expected
    assert leaf(tree, "x").ticks == leaf_ticks


def test_a_rate_controller_begins_its_child_at_its_rate() -> None:
    tree = scripted(
        '<PipelineSequence><RateController hz="2"><Leaf name="plan"/></RateController>'
        '<Leaf name="follow" script="R"/></PipelineSequence>'
    )
    run(tree, 21)
    assert leaf(tree, "plan").ticks == 5, "at 0, 0.5, 1, 1.5 and 2 s"
    tree.halt()
    run(tree, 1)
    assert leaf(tree, "plan").ticks == 6, "after a stop it begins at once"


BODIES = st.recursive(
    st.builds(lambda script: f'<Leaf script="{script}"/>', SCRIPTS),
    lambda inner: st.one_of(
        st.builds(
            lambda kind, children: f"<{kind}>{''.join(children)}</{kind}>",
            st.sampled_from(
                [
                    "Sequence",
                    "Fallback",
                    "ReactiveSequence",
                    "ReactiveFallback",
                    "PipelineSequence",
                    "RoundRobin",
                    "Parallel",
                ]
            ),
            st.lists(inner, min_size=1, max_size=3),
        ),
        st.builds(lambda a, b: f"<RecoveryNode>{a}{b}</RecoveryNode>", inner, inner),
        st.builds(
            lambda kind, child: f"<{kind}>{child}</{kind}>",
            st.sampled_from(["Inverter", "ForceSuccess", "RateController", "SingleTrigger"]),
            inner,
        ),
    ),
    max_leaves=8,
)


@given(BODIES, st.integers(1, 8))
def test_nothing_runs_in_a_tree_that_has_ended_or_was_halted(body: str, ticks: int) -> None:
    tree = scripted(body)
    last = run(tree, ticks)[-1]
    if last == "R":
        assert any(state.status == "running" for state in tree.states())
        tree.halt()
    assert all(state.status != "running" for state in tree.states())
