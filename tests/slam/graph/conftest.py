"""Fixtures: scans of a simulated world, and the features of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.scan_beams import beams_of

ANGLES = np.linspace(-math.pi / 2, math.pi / 2, 181).astype(np.float32)


@pytest.fixture
def angles() -> np.ndarray:
    return ANGLES


@pytest.fixture
def features_at():
    """Return a function: `features_at(world, pose, noise, seed)` gives the features of a scan from there."""

    def scan(world, pose: SE2, noise: float = 0.0, seed: int = 0, reach: float = 20.0) -> ScanFeatures:
        ranges = world.ranges(pose, ANGLES, reach)
        ranges = ranges + np.random.default_rng(seed).normal(0.0, noise, len(ranges)).astype(np.float32)
        return ScanFeatures.of(beams_of(ANGLES, ranges, IDENTITY, 80.0, 3.0), 40.0)

    return scan
