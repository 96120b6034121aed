"""Control nodes and decorators: the statuses they return, and what they tick and stop."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from py_trees.common import Status
from tests.support.scripted_trees import leaf, run, scripted

from chefbot.behavior_tree.controls import RecoveryNode, halt
from chefbot.behavior_tree.decorators import CountingDecorator, Repeat, RetryUntilSuccessful

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


def test_a_rate_controller_waits_after_a_success_only() -> None:
    tree = scripted('<RateController hz="2"><Leaf name="plan" script="SFFS"/></RateController>')
    assert run(tree, 9) == "SRRRRFFSR", "what fails before its time is over is tried at the next tick"


SEVERAL = st.lists(SCRIPTS, min_size=1, max_size=4)


@settings(max_examples=50)
@given(SEVERAL, st.integers(-1, 5), st.integers(-1, 5))
def test_a_parallel_ends_when_its_counts_decide(scripts: list[str], needed: int, fatal: int) -> None:
    leaves = "".join(f'<Leaf name="{i}" script="{script}"/>' for i, script in enumerate(scripts))
    tree = scripted(f'<Parallel success_count="{needed}" failure_count="{fatal}">{leaves}</Parallel>')
    needed, fatal = (len(scripts) if count < 0 else count for count in (needed, fatal))
    for tick in range(6):
        # what each child has ended with by this tick: its first letter that is not R
        ends = [script.ljust(7, script[-1])[: tick + 1].lstrip("R")[:1] for script in scripts]
        succeeded, failed = ends.count("S"), ends.count("F")
        hopeless = len(scripts) - failed < needed
        expected = "S" if succeeded >= needed else "F" if failed >= fatal or hopeless else "R"
        assert run(tree, 1) == expected
        for i, script in enumerate(scripts):
            lasts = script.ljust(7, script[-1]).find(ends[i]) + 1 if ends[i] else tick + 1
            assert leaf(tree, str(i)).ticks == lasts, "what has ended is not ticked again"
        if expected != "R":
            break


@settings(max_examples=50)
@given(st.integers(0, 5), st.integers(0, 5))
def test_a_recovery_node_tries_once_more_than_it_recovers(retries: int, failures: int) -> None:
    script = "F" * failures + "S"
    tree = scripted(
        f'<RecoveryNode number_of_retries="{retries}"><Leaf name="main" script="{script}"/>'
        '<Leaf name="recovery"/></RecoveryNode>'
    )
    assert run(tree, 1) == ("S" if failures <= retries else "F")
    recoveries = min(retries, failures)
    assert (leaf(tree, "main").ticks, leaf(tree, "recovery").ticks) == (recoveries + 1, recoveries)


def test_a_stopped_recovery_node_begins_with_its_first_child() -> None:
    tree = scripted(
        '<RecoveryNode number_of_retries="2"><Leaf name="main" script="FFR"/>'
        '<Leaf name="recovery" script="SR"/></RecoveryNode>'
    )
    assert run(tree, 1) == "R"
    node = next(one for one in tree.root.iterate() if isinstance(one, RecoveryNode))
    assert node.retries == 1
    tree.halt()
    assert node.retries == 0 and leaf(tree, "recovery").stops == 1
    run(tree, 1)
    assert leaf(tree, "main").ticks == 3


@settings(max_examples=50)
@given(SEVERAL)
def test_a_round_robin_fails_only_when_all_fail_in_a_row(scripts: list[str]) -> None:
    leaves = "".join(f'<Leaf name="{i}" script="{script}"/>' for i, script in enumerate(scripts))
    tree = scripted(f"<RoundRobin>{leaves}</RoundRobin>")
    turn, ticks, failed = 0, [0] * len(scripts), 0
    for _ in range(8):
        result = ""
        while not result:
            letter = scripts[turn].ljust(60, scripts[turn][-1])[ticks[turn]]
            ticks[turn] += 1
            failed = failed + 1 if letter == "F" else 0 if letter == "S" else failed
            turn = (turn + (letter != "R")) % len(scripts)
            result = "F" if failed == len(scripts) else letter.replace("F", "")
        turn, failed = (0, 0) if result == "F" else (turn, failed)
        assert run(tree, 1) == result
        assert [leaf(tree, str(i)).ticks for i in range(len(scripts))] == ticks


@settings(max_examples=50)
@given(SEVERAL)
def test_a_pipeline_reaches_a_child_when_all_before_it_succeeded(scripts: list[str]) -> None:
    leaves = "".join(f'<Leaf name="{i}" script="{script}"/>' for i, script in enumerate(scripts))
    tree = scripted(f"<PipelineSequence>{leaves}</PipelineSequence>")
    reached, ticks = 0, [0] * len(scripts)
    for _ in range(8):
        expected = "S"
        for i, script in enumerate(scripts):
            letter = script.ljust(60, script[-1])[ticks[i]]
            ticks[i] += 1
            if letter == "F" or (letter == "R" and i >= reached):
                expected = letter
                reached = i
                break
        assert run(tree, 1) == expected
        assert [leaf(tree, str(i)).ticks for i in range(len(scripts))] == ticks
        reached = reached if expected == "R" else 0


@pytest.mark.parametrize(
    ("kind", "port", "ends"), [("Repeat", "num_cycles", "F"), ("RetryUntilSuccessful", "num_attempts", "S")]
)
@settings(max_examples=50)
@given(SCRIPTS, st.integers(-1, 4))
def test_a_repetition_counts_what_has_ended(kind: str, port: str, ends: str, script: str, limit: int) -> None:
    tree = scripted(f'<{kind} {port}="{limit}"><Leaf name="x" script="{script}"/></{kind}>')
    other, count, expected = "S" if ends == "F" else "F", 0, ""
    for letter in script.ljust(12, script[-1]):
        count += letter == other
        if limit == 0 or count == limit:
            letter, count = other, 0
        elif letter == other:
            letter = "R"
        count = 0 if letter == ends else count
        expected += letter
    assert run(tree, 12) == expected
    assert leaf(tree, "x").ticks == (0 if limit == 0 else 12)


@pytest.mark.parametrize(("kind", "script", "end"), [(Repeat, "S", "S"), (RetryUntilSuccessful, "F", "F")])
def test_a_stopped_repetition_counts_from_zero(kind: type[CountingDecorator], script: str, end: str) -> None:
    name = kind.__name__
    tree = scripted(f'<{name} {kind._port}="3"><Leaf script="{script}"/></{name}>')
    assert run(tree, 2) == "RR"
    tree.halt()
    assert run(tree, 6) == f"RR{end}RR{end}"


def test_a_repetition_whose_number_becomes_zero_stops_its_child() -> None:
    tree = scripted('<Repeat num_cycles="{n}"><Leaf name="x" script="R"/></Repeat>')
    tree.blackboard.set("n", 3)
    assert run(tree, 2) == "RR"
    tree.blackboard.set("n", 0)
    assert run(tree, 1) == "S" and leaf(tree, "x").stops == 1


@pytest.mark.parametrize(
    ("body", "first", "again"),
    [
        ('<Timeout msec="250"><Leaf script="RSR"/></Timeout>', "RS", "RRRF"),
        ('<Timeout msec="250"><Leaf script="R"/></Timeout>', "RRRF", "RRRF"),
        ('<Delay delay_msec="250"><Leaf/></Delay>', "RRRS", "RRRS"),
    ],
)
def test_times_restart_after_an_end_and_after_a_stop(body: str, first: str, again: str) -> None:
    tree = scripted(body)
    assert run(tree, len(first)) == first
    assert run(tree, 2, start_s=10.0) == again[:2]
    tree.halt()
    assert run(tree, 4, start_s=20.0) == again


def test_a_timeout_stops_its_child_and_a_late_success_counts() -> None:
    tree = scripted('<Timeout msec="200"><Leaf name="x" script="R"/></Timeout>')
    assert run(tree, 3) == "RRF" and leaf(tree, "x").stops == 1
    assert run(scripted('<Timeout msec="200"><Leaf script="RRS"/></Timeout>'), 3) == "RRS"


def test_a_single_trigger_may_run_again_after_a_stop() -> None:
    tree = scripted('<SingleTrigger><Leaf name="x" script="RFRS"/></SingleTrigger>')
    assert run(tree, 4) == "RFFF" and leaf(tree, "x").ticks == 2
    halt(tree.root)
    assert run(tree, 3) == "RSF"


def test_a_halted_node_is_as_before_its_first_tick() -> None:
    tree = scripted('<Sequence><Leaf name="x" script="R"/></Sequence>')
    halt(tree.root)
    run(tree, 1)
    for _ in range(2):
        halt(tree.root)
        assert tree.root.status is leaf(tree, "x").status is Status.INVALID
    assert leaf(tree, "x").stops == 1, "the second time there was nothing to stop"


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
