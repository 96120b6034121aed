"""Tests that repeated, late and withdrawn stop requests do not stop the robot again after a release."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.ui.stop_requests import StopPresses

STEPS = st.lists(
    st.tuples(st.sampled_from(["press", "latch", "release", "withdraw"]), st.sampled_from("abc")), max_size=20
)


@given(STEPS)
def test_a_confirmed_or_withdrawn_press_never_counts_again(steps: list[tuple[str, str]]) -> None:
    presses, stopped, over = StopPresses(), False, set[str]()
    for step, key in steps:
        if step == "press":
            assert presses.press(key, stopped=stopped) == (key not in over)
        elif step == "latch" and presses.waiting:
            presses.latched()
            stopped = True
        elif step == "release":
            presses.clear()
            stopped = False
        elif step == "withdraw":
            presses.withdraw(key)
            over.add(key)
        over |= set(presses.confirmed)
        assert not (presses.waiting and stopped), "a press that the base has latched is confirmed"


def test_a_press_is_confirmed_only_by_a_later_latch() -> None:
    presses = StopPresses()
    presses.latched()
    assert presses.press("a", stopped=False) and presses.confirmed == ()
    presses.latched()
    assert presses.confirmed == ("a",)
    assert presses.press("b", stopped=True) and presses.confirmed == ("a", "b")
