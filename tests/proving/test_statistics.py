"""Wilson intervals against SciPy's, and differences that are significant when they should be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest
from tests.support.proving_runs import a_record

from chefbot.proving.comparison import changes
from chefbot.proving.figures import FIGURES
from chefbot.proving.statistics import MIN_PAIRS, paired_difference, wilson

SHARES = st.integers(1, 500).flatmap(lambda total: st.tuples(st.integers(0, total), st.just(total)))
VALUES = st.floats(-1000, 1000)
PAIRS = st.lists(st.tuples(VALUES, VALUES), min_size=1, max_size=20)


@given(SHARES)
def test_the_interval_of_a_share_is_that_of_scipy(share: tuple[int, int]) -> None:
    ours, theirs = wilson(*share), binomtest(*share).proportion_ci(method="wilson")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-12)
    assert ours.low <= ours.value <= ours.high


def test_nothing_is_known_without_a_run() -> None:
    share = wilson(0, 0)
    assert (share.low, share.high, share.total) == (0.0, 1.0, 0)
    assert math.isnan(share.value)
    assert math.isnan(paired_difference([], []).mean)
    assert not paired_difference([], []).is_significant


@settings(max_examples=40)
@given(PAIRS)
def test_a_difference_turns_its_sign_with_its_sides(pairs: list[tuple[float, float]]) -> None:
    old, new = [a for a, _ in pairs], [b for _, b in pairs]
    one, other = paired_difference(old, new), paired_difference(new, old)
    assert one.mean == pytest.approx(np.mean(np.subtract(new, old)))
    assert one.pairs == len(pairs)
    assert (one.mean, one.low, one.high) == pytest.approx((-other.mean, -other.high, -other.low), abs=1e-9)
    smallest, largest = np.subtract(new, old).min(), np.subtract(new, old).max()
    assert smallest - 1e-9 <= one.low <= one.high <= largest + 1e-9
    assert one.is_significant == (len(pairs) >= MIN_PAIRS and (one.low > 0 or one.high < 0))
    assert one == paired_difference(old, new)


def test_the_bootstrap_interval_has_the_width_of_the_normal_one() -> None:
    differences = np.random.default_rng(1).normal(0.3, 2.0, 400)
    found = paired_difference(np.zeros(400), differences)
    half = 1.96 * differences.std() / math.sqrt(400)
    assert found.high - found.low == pytest.approx(2 * half, rel=0.05)


def test_few_pairs_and_equal_values_are_not_significant() -> None:
    assert not paired_difference([0.0] * (MIN_PAIRS - 1), [1.0] * (MIN_PAIRS - 1)).is_significant
    assert paired_difference([0.0] * MIN_PAIRS, [1.0] * MIN_PAIRS).is_significant
    assert not paired_difference([3.0] * 50, [3.0] * 50).is_significant


def test_more_success_is_better_and_more_time_is_worse() -> None:
    seeds = range(1, 41, 2)
    old = [
        a_record(seed, success=seed % 3 == 0, figures={"time": 50.0, "path_length": 5.0}) for seed in seeds
    ]
    new = [a_record(seed, figures={"time": 60.0 + seed / 10, "path_length": 9.0}) for seed in seeds]
    by_figure = {change.figure: change for change in changes(old, new)}
    assert by_figure["success"].is_better and not by_figure["success"].is_worse
    assert by_figure["time"].is_worse and not by_figure["time"].is_better
    assert by_figure["time"].difference.pairs == sum(record.success for record in old), "both succeeded"
    more = by_figure["path_length"]
    assert more.difference.is_significant and not (more.is_better or more.is_worse)
    assert {change.figure for change in changes(new, old) if change.is_worse} == {"success"}
    assert {change.figure for change in changes(new, old) if change.is_better} == {"time"}


def test_even_seeds_are_compared_only_without_odd_ones() -> None:
    worse = {seed: a_record(seed, success=seed % 2 == 1) for seed in range(1, 41)}
    old = [a_record(seed) for seed in worse]
    assert not any(change.is_worse for change in changes(old, list(worse.values())))
    even = [record for seed, record in worse.items() if seed % 2 == 0]
    assert [change.figure for change in changes(old, even) if change.is_worse] == ["success"]


def test_what_only_one_version_ran_is_not_compared() -> None:
    old = [a_record(seed, scenario="other") for seed in range(1, 20)]
    assert changes(old, [a_record(seed) for seed in range(1, 20)]) == []
    assert changes([], [a_record(1)]) == []


def test_every_figure_has_a_meaning() -> None:
    assert all(figure.meaning and figure.better in (-1, 0, 1) for figure in FIGURES.values())
