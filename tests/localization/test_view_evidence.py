"""Correlated scans from one viewpoint are discounted, and motion to another one brings new evidence."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.localization.view_evidence import EVIDENCE_PER_VIEWPOINT, NEW_VIEWPOINT_DISTANCE, ViewEvidence
from chefbot.maths.se2 import SE2


@given(st.lists(st.floats(0.0, 0.3), max_size=50), st.floats(-1.0, 1.0))
def test_scans_from_one_place_use_no_more_than_a_viewpoint(shares: list[float], turn: float) -> None:
    evidence, used = ViewEvidence(), 0.0
    for share in shares:
        used += min(share, evidence.left)
        evidence.use(min(share, evidence.left))
        evidence.move(SE2(0.0, 0.0, turn), 2.0 * math.pi)
    assert used <= EVIDENCE_PER_VIEWPOINT + 1e-9


def test_motion_and_rotation_of_a_narrow_view_renew_it() -> None:
    evidence = ViewEvidence()
    evidence.use(1.0)
    assert evidence.left == 0.0
    evidence.move(SE2(0.5 * NEW_VIEWPOINT_DISTANCE, 0.0, 3.0), 2.0 * math.pi)
    assert evidence.left == pytest.approx(0.5 * EVIDENCE_PER_VIEWPOINT)
    evidence.move(SE2(0.0, 0.0, -0.25), 1.0)
    assert evidence.left == pytest.approx(0.75 * EVIDENCE_PER_VIEWPOINT)
    evidence.move(SE2(9.0, 0.0, 0.0), 1.0)
    assert evidence.left == EVIDENCE_PER_VIEWPOINT, "no more than one viewpoint is kept"
