"""The command multiplexer: priority of teleoperation, commands held during a stop, lost processes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.safety.command_multiplexer import RELEASE_TIMEOUT_NS, CommandMultiplexer, CommandSource

TELEOP, NAVIGATION = CommandSource.TELEOP, CommandSource.NAVIGATION
STEP = RELEASE_TIMEOUT_NS // 3
HOLD_NS = 1_000_000_000


def selected(commands: CommandMultiplexer, now_ns: int) -> tuple[float, float]:
    command = commands.select(now_ns)
    return command.v, command.w


def test_without_a_command_the_base_stands() -> None:
    assert selected(CommandMultiplexer(1.0), 0) == (0.0, 0.0)


def test_teleoperation_overrides_navigation_for_the_hold_time() -> None:
    commands = CommandMultiplexer(1.0)
    commands.accept(NAVIGATION, 0.1, 0.0, 0, stopped=False)
    commands.accept(TELEOP, -0.2, 0.3, 0, stopped=False)
    assert selected(commands, HOLD_NS) == (-0.2, 0.3)
    assert selected(commands, HOLD_NS + 1) == (0.1, 0.0)
    assert commands.select(HOLD_NS + 1).age(HOLD_NS) == 1.0


@given(st.lists(st.integers(0, RELEASE_TIMEOUT_NS), min_size=1, max_size=30), st.sampled_from(CommandSource))
def test_a_command_held_through_a_stop_never_counts(pauses: list[int], source: CommandSource) -> None:
    commands, now_ns = CommandMultiplexer(1.0), 0
    commands.accept(source, 0.2, 0.0, now_ns, stopped=True)
    for pause in pauses:
        now_ns += pause
        commands.accept(source, 0.2, 0.0, now_ns, stopped=False)
        assert selected(commands, now_ns) == (0.0, 0.0)
    commands.accept(source, 0.2, 0.0, now_ns + RELEASE_TIMEOUT_NS + 1, stopped=False)
    assert selected(commands, now_ns + RELEASE_TIMEOUT_NS + 1) == (0.2, 0.0)


def test_a_zero_command_ends_the_hold_of_its_source() -> None:
    commands = CommandMultiplexer(1.0)
    commands.accept(TELEOP, 0.2, 0.0, 0, stopped=True)
    commands.accept(NAVIGATION, 0.1, 0.0, STEP, stopped=False)
    assert selected(commands, STEP) == (0.1, 0.0)
    commands.accept(TELEOP, 0.0, 0.0, STEP, stopped=False)
    commands.accept(TELEOP, 0.2, 0.0, 2 * STEP, stopped=False)
    assert selected(commands, 2 * STEP) == (0.2, 0.0)


@given(st.lists(st.sampled_from(["slam", "planner", "page"]), min_size=1, max_size=6))
def test_navigation_counts_again_only_when_no_process_is_missing(names: list[str]) -> None:
    commands = CommandMultiplexer(1.0)
    for name in names:
        commands.lose_process(name)
    missing = set(names)
    for now_ns, name in enumerate(sorted(missing)):
        commands.accept(NAVIGATION, 0.1, 0.0, now_ns, stopped=False)
        assert selected(commands, now_ns) == (0.0, 0.0)
        commands.restore_process(name)
    assert selected(commands, 10) == (0.1, 0.0)


@pytest.mark.parametrize("discard", ["discard", "lose_process"])
def test_discarded_commands_do_not_resume(discard: str) -> None:
    commands = CommandMultiplexer(1.0)
    for source in CommandSource:
        commands.accept(source, 0.1, 0.0, 0, stopped=False)
    if discard == "discard":
        commands.discard()
    else:
        commands.lose_process("slam")
        commands.restore_process("slam")
    assert selected(commands, 1) == (0.0, 0.0)
    commands.accept(TELEOP, 0.3, 0.0, 2, stopped=False)
    assert selected(commands, 2) == (0.3, 0.0)


def test_a_pause_of_300_ms_makes_a_command_new() -> None:
    """The figure of the guide: who lets go for a third of a second has let go."""
    commands = CommandMultiplexer(1.0)
    commands.accept(TELEOP, 0.2, 0.0, 0, stopped=True)
    assert commands.refuses(TELEOP, 300_000_000) and not commands.refuses(TELEOP, 300_000_001)
    assert not commands.refuses(NAVIGATION, 0)


@pytest.mark.parametrize("twist", [(0.2, 0.0), (0.0, 0.5), (-0.2, -0.5)])
def test_an_interrupted_command_has_to_be_let_go(twist: tuple[float, float]) -> None:
    commands = CommandMultiplexer(1.0)
    commands.accept(TELEOP, *twist, 0, stopped=False)
    commands.interrupt(TELEOP, STEP)
    assert commands.refuses(TELEOP, STEP) and selected(commands, STEP) == (0.0, 0.0)
    commands.accept(TELEOP, *twist, 2 * STEP, stopped=False)
    assert selected(commands, 2 * STEP) == (0.0, 0.0)
    commands.accept(TELEOP, *twist, 6 * STEP, stopped=False)
    assert selected(commands, 6 * STEP) == twist


def test_an_interruption_refuses_nobody_who_stands() -> None:
    """Whoever begins to drive later is new: neither a source without a command nor one at standstill is held."""
    commands = CommandMultiplexer(1.0)
    commands.interrupt(TELEOP, 0)
    commands.accept(NAVIGATION, 0.0, 0.0, 0, stopped=False)
    commands.interrupt(NAVIGATION, 0)
    for source in CommandSource:
        assert not commands.refuses(source, 0)
        commands.accept(source, 0.1, 0.0, 1, stopped=False)
    assert commands.select(1).source is TELEOP


@given(
    st.lists(
        st.tuples(st.sampled_from(CommandSource), st.sampled_from([0.0, 0.1, float("nan")]), st.booleans()),
        max_size=20,
    )
)
def test_nothing_that_came_during_a_stop_moves_the_robot(
    events: list[tuple[CommandSource, float, bool]],
) -> None:
    commands = CommandMultiplexer(1.0)
    for now_ns, (source, v, stopped) in enumerate(events):
        if stopped:
            commands.discard()
        commands.accept(source, v, 0.0, now_ns, stopped=stopped)
        if stopped:
            assert selected(commands, now_ns) == (0.0, 0.0)
