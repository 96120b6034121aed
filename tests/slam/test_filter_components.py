"""Tests beams, particle weights, particle ancestry and the motion model of Gmapping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.resampling import low_variance
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.motion_model import OdometryStep, compose
from chefbot.slam.params import GmappingParams
from chefbot.slam.particle_ancestry import ParticleAncestry
from chefbot.slam.resampling import effective_number, normalized
from chefbot.slam.scan_beams import beams_of, reach, thinned


def test_beams_follow_rep_117() -> None:
    ranges = np.array([2.0, np.inf, np.nan, -np.inf, 0.0, 9.0], np.float32)
    beams = beams_of(
        np.zeros(6, np.float32), ranges, SE2(0.2, 0, math.pi / 2), max_range=5.0, clear_range=3.0
    )
    assert beams.ends == pytest.approx(np.array([[0.2, 2.0], [0.2, 3.0], [0.2, 5.0]]), abs=1e-6)
    assert beams.hit.tolist() == [True, False, False]
    assert reach(beams) == pytest.approx(math.hypot(0.2, 5.0))


def test_a_scan_without_any_measurement_has_no_beam() -> None:
    beams = beams_of(np.zeros(3, np.float32), np.full(3, np.nan, np.float32), SE2(0.2, 0, 0), 5.0, 3.0)
    assert len(beams.ends) == 0
    assert reach(beams) == pytest.approx(0.2)


def test_thinning_keeps_every_surface_within_the_spacing() -> None:
    points = np.column_stack([np.linspace(0, 5, 640), np.ones(640)]).astype(np.float32)
    kept = thinned(points, np.float32(0.5))
    assert (np.diff(kept[:, 0]) >= 0.5).all()
    assert np.abs(points[:, None, 0] - kept[None, :, 0]).min(axis=1).max() < 0.5


@given(st.lists(st.floats(-50, 0), min_size=1, max_size=60), st.floats(0, 0.999))
def test_systematic_resampling_gives_each_its_share(logs: list[float], offset: float) -> None:
    weights = normalized(np.array(logs))
    assert weights.sum() == pytest.approx(1)
    assert 1 - 1e-9 <= effective_number(weights) <= len(logs) + 1e-9
    share = weights * len(logs)
    counts = np.bincount(low_variance(weights, len(weights), offset), minlength=len(logs))
    assert counts.sum() == len(logs)
    assert (counts >= np.floor(share - 1e-9)).all() and (counts <= np.ceil(share + 1e-9)).all()


@given(st.integers(0, 10_000), st.lists(st.booleans(), min_size=1, max_size=40))
def test_shared_paths_equal_copied_paths(seed: int, resample: list[bool]) -> None:
    rng, n = np.random.default_rng(seed), 6
    tree, naive = ParticleAncestry(n), [[] for _ in range(n)]
    for again in resample:
        if again:
            parents = np.sort(rng.integers(0, n, n))
            tree.resample(parents)
            naive = [list(naive[j]) for j in parents]
            before = len(tree.common_path)
            settled = tree.collapse_common_ancestors()
            assert len(tree.common_path) == before + len(settled)
        poses = rng.normal(size=(n, 3))
        tree.append(poses)
        for path, pose in zip(naive, poses, strict=True):
            path.append(pose)
    for i in range(n):
        assert np.array_equal(tree.path(i), np.array(naive[i]))


def test_path_memory_stays_bounded() -> None:
    rng, tree = np.random.default_rng(3), ParticleAncestry(30)
    for _ in range(500):
        tree.resample(np.sort(rng.integers(0, 30, 30)))
        tree.collapse_common_ancestors()
        tree.append(np.zeros((30, 3)))
        assert len(tree.branch(0)) < 250
    assert len(tree.path(0)) == 500


@given(*[st.floats(-9, 9)] * 6)
def test_batched_composition_equals_single_composition(x, y, yaw, dx, dy, turn) -> None:
    expected = SE2(x, y, yaw) @ SE2(dx, dy, turn)
    got = compose(np.array([[x, y, yaw]]), np.array([dx, dy, turn]))[0]
    assert got[:2] == pytest.approx(expected[:2], abs=1e-9)
    assert math.remainder(got[2] - expected.yaw, 2 * math.pi) == pytest.approx(0, abs=1e-9)


def test_a_detour_is_less_certain_than_the_straight_path() -> None:
    straight, detour = OdometryStep(), OdometryStep()
    straight.add(SE2(1, 0, 0))
    for part in (SE2(2, 0, 0), SE2(0, 0, 0.5), SE2(0, 0, -0.5), SE2(-1, 0, 0)):
        detour.add(part)
    assert detour.motion == pytest.approx(straight.motion)
    assert (detour.variance(GmappingParams()) > straight.variance(GmappingParams())).all()


@pytest.mark.parametrize(("moved", "turned"), [(0.15, 0.0), (0.0, 0.12)])
def test_where_the_robot_stands_a_share_of_the_motion_is_enough(moved: float, turned: float) -> None:
    often = GmappingParams(linear_update=0.5, angular_update=0.4, standing_update=0.25)
    never = GmappingParams(linear_update=0.5, angular_update=0.4)
    step = OdometryStep()
    step.add(SE2(moved, 0.0, turned))
    assert not step.is_enough(often), "it still moves"
    step.add(IDENTITY)
    assert step.is_enough(often) and not step.is_enough(never)


@pytest.mark.parametrize(("moved", "turned"), [(0.51, 0.0), (0.0, 0.41)])
def test_a_scan_is_processed_on_the_way(moved: float, turned: float) -> None:
    step = OdometryStep()
    assert not step.is_enough(GmappingParams())
    step.add(SE2(moved, 0.0, turned))
    assert step.is_enough(GmappingParams(linear_update=0.5, angular_update=0.4))
