"""The test of an alternative hypothesis: from which log odds on it counts."""

from __future__ import annotations

from typing import Any, cast

import pytest

from chefbot.localization.recovery import LOG_ODDS_THRESHOLD, HypothesisTest


@pytest.mark.parametrize(
    ("advantage", "favoured", "outperforms", "rejected"),
    [
        (-1.1, False, False, True),
        (-0.1, False, False, False),
        (0.4, True, False, False),
        (0.6, True, True, False),
        (1.1, True, True, False),
    ],
)
def test_a_small_advantage_does_not_count(
    advantage: float, favoured: bool, outperforms: bool, rejected: bool
) -> None:
    test = HypothesisTest(cast(Any, None))
    test.log_odds = advantage * LOG_ODDS_THRESHOLD
    assert (test.favoured, test.outperforms, test.rejected) == (favoured, outperforms, rejected)
    assert not test.accepted  # not before it was narrow for some updates
