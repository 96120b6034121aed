"""The probability of a pose is lower with each sign of a wrong one; the state of the localization names its cause."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.localization.messages import describe
from chefbot.localization.pose_probability import WEIGHTS, PoseQuality

SURE = PoseQuality(1.0, 0.95, 0.02, 0.01, 0.0, False, 60)
share = st.floats(0.0, 1.0)


@given(
    st.builds(
        PoseQuality,
        share, share, st.floats(0.0, 50.0), st.floats(0.0, 4.0), share, st.booleans(), st.integers(0, 10**6),
    )
)  # fmt: skip
def test_it_is_a_probability_of_finite_inputs(quality: PoseQuality) -> None:
    assert len(quality.features()) == len(WEIGHTS)
    assert 0.0 <= quality.probability <= 1.0 and math.isfinite(quality.features().sum())


@pytest.mark.parametrize(
    "worse",
    [
        {"weight": 0.5},
        {"explained": 0.4},
        {"spread": 1.5},
        {"spread_yaw": 0.8},
        {"outperformed": True},
    ],
    ids=str,
)
def test_each_sign_of_a_wrong_pose_lowers_it(worse: dict[str, float]) -> None:
    assert SURE.probability > 0.95
    assert SURE._replace(**worse).probability < SURE.probability


@pytest.mark.parametrize(
    ("quality", "localized", "sentence"),
    [
        (SURE, True, "Localized to within 0.02 m."),
        (
            SURE._replace(explained=0.6),
            True,
            "Localized to within 0.02 m; 40% of the scan is not on the map.",
        ),
        (
            SURE._replace(explained=0.5, spread=0.2),
            True,
            "Localized, but perhaps wrong: 50% of the scan is not on the map here.",
        ),
        (SURE._replace(updates=0), False, "Unsure: no scan has been compared with the map yet."),
        (SURE._replace(weight=0.41), False, "Unsure: several places are possible, the likeliest with 41%."),
        (SURE._replace(explained=0.3), False, "Lost: 70% of the scan is not on the map here."),
        (SURE._replace(outperformed=True), False, "Unsure: another place explains the scans better."),
        (SURE._replace(spread=0.8), False, "Unsure: the position is known to within 0.80 m only."),
    ],
)
def test_the_state_names_its_cause(quality: PoseQuality, localized: bool, sentence: str) -> None:
    assert describe(quality, localized) == sentence
