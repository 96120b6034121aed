"""The test of an alternative hypothesis: from which lead on it counts."""

from __future__ import annotations

from typing import Any, cast

import pytest

from chefbot.localization.recovery import LOG_ODDS_THRESHOLD, HypothesisTest


@pytest.mark.parametrize(
    ("lead", "leads", "outperforms", "lost"),
    [
        (-1.1, False, False, True),
        (-0.1, False, False, False),
        (0.4, True, False, False),
        (0.6, True, True, False),
        (1.1, True, True, False),
    ],
)
def test_a_small_lead_does_not_count(lead: float, leads: bool, outperforms: bool, lost: bool) -> None:
    test = HypothesisTest(cast(Any, None))
    test.lead = lead * LOG_ODDS_THRESHOLD
    assert (test.leads, test.outperforms, test.lost) == (leads, outperforms, lost)
    assert not test.won  # not before it was narrow for some updates
