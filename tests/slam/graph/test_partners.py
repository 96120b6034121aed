"""Tests which scans are registered with each other."""

from __future__ import annotations

import itertools
import math

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.slam.graph.partners import PARTNERS, partners

REACH, METRES_PER_RADIAN = 10.0, 2.0
"""Largest distance of partners, and what a radian between their headings counts as, m."""
POSES = st.lists(st.tuples(*[st.floats(-15.0, 15.0)] * 2, st.floats(-9.0, 9.0)), min_size=1, max_size=40)


def pairs_of(poses) -> list[tuple[int, int]]:
    return list(zip(*(index.tolist() for index in partners(np.array(poses, float))), strict=True))


def distance(a, b) -> float:
    return math.dist(a[:2], b[:2]) + METRES_PER_RADIAN * abs(math.remainder(b[2] - a[2], 2.0 * math.pi))


def assume_no_ties(poses) -> None:
    """Leave out scans at equal distances, any of which may be chosen, and those at the edge of the reach."""
    gaps = sorted([REACH, *(distance(*pair) for pair in itertools.combinations(poses, 2))])
    assume(min(np.diff(gaps), default=1.0) > 1e-6)


@settings(max_examples=50)
@given(POSES)
def test_pairs_are_unique_and_of_neighbours(poses) -> None:
    pairs = pairs_of(poses)
    assert len(set(pairs)) == len(pairs)
    for a, b in pairs:
        assert 0 <= a < b < len(poses)
        assert b - a <= 2 or distance(poses[a], poses[b]) <= REACH + 1e-6
    assert {(k, k + step) for step in (1, 2) for k in range(len(poses) - step)} <= set(pairs)
    assert len(pairs) <= (PARTNERS + 2) * len(poses)


@settings(max_examples=50)
@given(POSES)
def test_the_nearest_and_the_farthest_in_reach_are_partners(poses) -> None:
    assume_no_ties(poses)
    pairs = set(pairs_of(poses))
    for a, pose in enumerate(poses):
        others = sorted(
            (b for b in range(len(poses)) if b != a and distance(pose, poses[b]) <= REACH),
            key=lambda b: distance(pose, poses[b]),
        )
        chosen = others if len(others) <= PARTNERS else [others[0], others[-1]]
        assert {tuple(sorted((a, b))) for b in chosen} <= pairs


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.integers(2, PARTNERS))
def test_of_few_scans_in_one_place_all_are_partners(seed: int, count: int) -> None:
    poses = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))
    assert pairs_of(poses) == list(itertools.combinations(range(count), 2))


@settings(max_examples=40)
@given(POSES, st.floats(-30.0, 30.0), st.integers(-3, 3))
def test_place_and_turns_of_the_map_do_not_matter(poses, shift: float, turns: int) -> None:
    assume_no_ties(poses)
    moved = np.array(poses) + np.array([shift, 0.0, 2.0 * math.pi * turns])
    assert pairs_of(moved) == pairs_of(poses)


def test_opposite_views_from_afar_are_not_partners() -> None:
    ahead, back = [0.0, 0.0, 0.0], [5.0, 0.0, math.pi]
    away = [[100.0 * k, 50.0, 0.0] for k in range(1, 4)]
    assert (0, 4) not in pairs_of([ahead, *away, back])
    assert (0, 4) in pairs_of([ahead, *away, [5.0, 0.0, 0.5]])


def test_a_single_scan_has_no_partner() -> None:
    assert pairs_of([(1.0, 2.0, 0.3)]) == []


def test_a_scan_among_many_has_few_partners() -> None:
    poses = np.column_stack([np.linspace(0.0, 4.0, 200), np.zeros(200), np.zeros(200)])
    counts = np.bincount(np.concatenate(partners(poses)))
    assert counts.min() >= 4 and np.median(counts) <= 3 * PARTNERS
    spans = np.abs(np.subtract(*partners(poses)))
    assert (spans > 20).sum() > 100, "far ones keep a chain straight"
