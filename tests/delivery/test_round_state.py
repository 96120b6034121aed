"""The drive that follows from the state of a delivery round."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from chefbot.delivery.round_state import RoundState
from chefbot.delivery.status_messages import IDLE_STATES, ROUND_STATES
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Errand

STATES = st.sampled_from([*ROUND_STATES, *IDLE_STATES, "errand"])


@given(state=STATES, hold_reason=st.sampled_from(["", "stop", "choice", "errand"]))
def test_a_held_round_drives_nowhere_but_on_an_errand(state: str, hold_reason: str) -> None:
    goal = Errand(name="window")
    round_ = RoundState("kitchen", "home", lambda names: names, lambda _: None)
    round_.status = DeliveryStatus(state=state, place="table_3", hold_reason=hold_reason, errands=(goal,))
    leg = round_.leg
    if hold_reason == "errand" or (state == "errand" and not hold_reason):
        assert leg is not None and (leg.place, leg.pose) == ("window", goal.pose)
    elif not hold_reason and state in ("driving", "returning"):
        assert leg is not None and (leg.place, leg.pose) == ("table_3", None)
    else:
        assert leg is None
    assert round_.in_progress == (state in ROUND_STATES)
