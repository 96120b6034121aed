"""Which wheel speeds are passed on: fresh ones, after a stop was commanded, never faster than allowed."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from chefbot.board.command_gate import COMMAND_TIMEOUT_NS, STANDSTILL, CommandGate

MAX_SPEED = 3.0
speeds = st.one_of(st.floats(-60.0, 60.0), st.sampled_from([0.0, math.nan, math.inf]))


@given(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0))
def test_a_fast_command_is_scaled_with_its_curvature_kept(left: float, right: float) -> None:
    gate = CommandGate(MAX_SPEED)
    gate.command(0.0, 0.0, 0)
    gate.command(left, right, 0)
    first, second = gate.speeds(0)
    assert max(abs(first), abs(second)) <= MAX_SPEED + 1e-12
    assert math.isclose(first * right, second * left, abs_tol=1e-9)


def test_a_stop_comes_before_motion_after_release_and_reset() -> None:
    gate = CommandGate(MAX_SPEED)
    for begin in (lambda: None, gate.clear, gate.reset):
        begin()
        gate.command(1.0, 1.0, 0)
        assert gate.speeds(0) == STANDSTILL
        gate.command(0.0, 0.0, 0)
        gate.command(1.0, 1.0, 0)
        assert gate.speeds(0) == (1.0, 1.0)


@given(st.lists(st.tuples(speeds, speeds, st.integers(0, 200_000_000)), max_size=10), st.booleans())
def test_an_old_command_and_an_emergency_stop_stand(
    commands: list[tuple[float, float, int]], stopped: bool
) -> None:
    gate, now_ns, newest_ns = CommandGate(MAX_SPEED), 0, -COMMAND_TIMEOUT_NS
    for left, right, pause_ns in commands:
        now_ns += pause_ns
        gate.command(left, right, now_ns)
        newest_ns = now_ns if math.isfinite(left) and math.isfinite(right) else newest_ns
    if stopped:
        gate.stop()
    assert gate.speeds(newest_ns + COMMAND_TIMEOUT_NS) == STANDSTILL
    if stopped:
        assert gate.speeds(now_ns) == STANDSTILL
