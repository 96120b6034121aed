"""Tests the solver of the pose graph against optima that are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.slam.graph.edges import Edges
from chefbot.slam.graph.least_squares import edge_costs, inverse, linearized
from chefbot.slam.graph.pose_graph import optimized
from chefbot.slam.graph.submap_graph import softened


def edges_of(poses, pairs, noise: float = 0.0, seed: int = 0, kernel: float = np.inf) -> Edges:
    """Return edges that measure the poses at the pairs, with noise."""
    rng = np.random.default_rng(seed)
    measured = np.array([SE2.of(poses[a]).between(SE2.of(poses[b])).array() for a, b in pairs])
    measured = measured + rng.normal(0.0, 1.0, measured.shape) * noise
    root = rng.uniform(-1.0, 1.0, (len(pairs), 3, 3))
    information = root @ root.transpose(0, 2, 1) + np.diag([100.0, 100.0, 1000.0])
    of, to = np.array(pairs).T
    return Edges(of, to, measured, information, np.full(len(pairs), kernel))


def ring_of(n: int):
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    return np.column_stack([5.0 * np.cos(angle), 5.0 * np.sin(angle), angle + np.pi / 2])


def chain_and_loops(n: int) -> list[tuple[int, int]]:
    return [(k, k + 1) for k in range(n - 1)] + [(0, n - 1), (n // 4, 3 * n // 4)]


@settings(max_examples=15, deadline=None)
@given(n=st.integers(4, 40), seed=st.integers(0, 10_000))
def test_consistent_measurements_are_met_exactly(n: int, seed: int) -> None:
    true = ring_of(n)
    edges = edges_of(true, chain_and_loops(n), seed=seed)
    start = true + np.random.default_rng(seed).normal(0.0, 0.1, true.shape)
    start[0] = true[0]
    found = optimized(start, edges)
    assert found == pytest.approx(true, abs=1e-3)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_gradient_is_that_of_the_cost(seed: int) -> None:
    true = ring_of(6)
    edges = edges_of(true, chain_and_loops(6), 0.1, seed, kernel=30.0)
    poses = true + np.random.default_rng(seed).normal(0.0, 0.05, true.shape)
    _, gradient = linearized(poses, edges)
    for k in range(poses.size):
        step = np.zeros(poses.size)
        step[k] = 1e-6
        step = step.reshape(poses.shape)
        slope = (edge_costs(poses + step, edges).sum() - edge_costs(poses - step, edges).sum()) / 2e-6
        assert gradient[k] == pytest.approx(slope, rel=1e-4, abs=1e-3)


def test_the_optimum_of_noisy_edges_is_found() -> None:
    true = ring_of(30)
    edges = edges_of(true, chain_and_loops(30), np.array([0.02, 0.02, 0.01]), 1)
    start = [true[0]]
    for k in range(29):
        start.append((SE2.of(start[-1]) @ SE2.of(edges.measured[k])).array())
    found = optimized(np.array(start), edges)
    assert found[0] == pytest.approx(true[0])
    for other in (np.array(start), true):
        assert edge_costs(found, edges).sum() < edge_costs(other, edges).sum()
    _, gradient = linearized(found, edges)
    assert np.abs(gradient[3:]).max() < 1e-2 * np.abs(linearized(np.array(start), edges)[1]).max()


def test_the_robust_kernel_bounds_a_false_edge() -> None:
    true = ring_of(30)
    good = edges_of(true, chain_and_loops(30))
    false = Edges(np.array([3]), np.array([17]), np.zeros((1, 3)), 1000.0 * np.eye(3)[None], np.array([9.0]))
    found = optimized(true, Edges.concatenated([good, false]))
    assert np.abs(found - true).max() < 0.02


@pytest.mark.slow
def test_a_graph_of_20000_poses_is_solved() -> None:
    n = 20_000
    s = np.arange(n) * 0.1
    true = np.column_stack([30.0 * np.cos(s / 30.0), 30.0 * np.sin(s / 30.0), s / 30.0 + np.pi / 2])
    loops = [(k, k + 1885) for k in range(0, n - 1885, 50)]
    edges = edges_of(true, [(k, k + 1) for k in range(n - 1)] + loops)
    drift = np.column_stack([np.zeros(n), np.zeros(n), 1e-5 * np.arange(n)])
    assert optimized(true + drift, edges, 6)[:, :2] == pytest.approx(true[:, :2], abs=0.1)


def test_no_edges_move_nothing() -> None:
    poses = ring_of(5)
    assert optimized(poses, Edges.empty()).tolist() == poses.tolist()


def test_softened_information_adds_a_covariance() -> None:
    information, floor = np.diag([100.0, 400.0, 0.0]), np.diag([0.01, 0.04, 0.09])
    assert np.diag(softened(information, floor)) == pytest.approx([50.0, 1.0 / (1 / 400 + 0.04), 0.0])
    assert inverse(floor) == pytest.approx(np.diag([100.0, 25.0, 1 / 0.09]))
