"""The systematic errors of odometry that a map shows, as `chefbot map slam` prints them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from chefbot.cli.map.odometry_text import odometry_text
from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session
from chefbot.slam.systematic_errors import NO_ERRORS, SystematicErrors, errors_of_drives

ANGLES = np.linspace(-math.pi, math.pi, 8, endpoint=False).astype(np.float32)
SLIPS = (40, 90)
"""Steps in which the wheels slip."""


def drive() -> list[SE2]:
    """Return true poses of a drive with curves to both sides."""
    poses = [SE2(0.0, 0.0, 0.0)]
    for k in range(120):
        poses.append(poses[-1] @ SE2(0.4, 0.0, 0.5 * math.sin(0.3 * k) + 0.1))
    return poses


def session_of(truth: list[SE2], errors: SystematicErrors, slips: int = 0) -> Session:
    """Return a drive whose odometry has these errors, and in the first of SLIPS the wheels turn 0.3 m too far."""
    odometry = [SE2(0.0, 0.0, 0.0)]
    for k, (a, b) in enumerate(itertools.pairwise(truth)):
        step = a.between(b)
        length = step.x / errors.distance + (0.3 if k in SLIPS[:slips] else 0.0)
        turn = (step.yaw - errors.bend * step.x / errors.distance) / errors.turn
        odometry.append(odometry[-1] @ SE2(length, step.y / errors.distance, turn))
    scans = [
        RecordedScan(0.1 * k, ANGLES, np.full(8, 2.0, np.float32), one, one) for k, one in enumerate(odometry)
    ]
    return Session.of(scans, [True] * len(scans), 20.0, None)


@pytest.mark.parametrize("slips", [0, 2])
@pytest.mark.parametrize(
    "errors", [NO_ERRORS, SystematicErrors(0.95, 1.02, 0.02), SystematicErrors(1.04, 0.97, -0.01)]
)
def test_the_errors_of_the_wheels_are_found(errors: SystematicErrors, slips: int) -> None:
    truth = drive()
    found = errors_of_drives([session_of(truth, errors, slips)], truth)
    assert found is not None
    assert found.distance == pytest.approx(errors.distance, abs=0.005)
    assert found.turn == pytest.approx(errors.turn, abs=0.005)
    assert found.bend == pytest.approx(errors.bend, abs=0.002)


@pytest.mark.parametrize(("scans", "shown"), [(1, False), (12, False), (15, True)])
def test_a_short_drive_shows_no_errors(scans: int, shown: bool) -> None:
    truth = drive()[:scans]
    errors = errors_of_drives([session_of(truth, NO_ERRORS)], truth)
    assert (errors is not None) == shown
    assert ("too short to show" in odometry_text(errors)) != shown


def test_the_sentence_names_size_and_direction() -> None:
    assert odometry_text(SystematicErrors(1.0 / 1.026, 1.0 / 0.99, math.radians(0.3))) == (
        "Odometry measures distances 2.6% too long and turns 1.0% too small, and drifts 0.30° per metre to the right."
    )
    assert odometry_text(SystematicErrors(1.0 / 0.974, 1.0 / 1.01, math.radians(-0.3))) == (
        "Odometry measures distances 2.6% too short and turns 1.0% too large, and drifts 0.30° per metre to the left."
    )
