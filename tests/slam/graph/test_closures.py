"""Tests which loop closures are found, and that false ones are refused or taken back."""

from __future__ import annotations

import numpy as np
import pytest

from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.closures import Closure, find_closure, verify
from chefbot.slam.graph.consistency import Consistency
from chefbot.slam.graph.loop_closer import LoopCloser
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.graph.submap import ScanNode, Submap
from chefbot.slam.graph.submap_graph import SubmapGraph
from chefbot.slam.graph.submap_view import SubmapView, SubmapViews
from chefbot.slam.scan_beams import beams_of

CERTAIN = np.diag([1e4, 1e4, 1e5])


@pytest.fixture
def view_at(ring, angles):
    """Return a function that gives the view of a submap of scans in the ring, at poses in the frame of the first."""

    def view(poses: list[SE2]) -> SubmapView:
        nodes, submap = [], Submap()
        for k, pose in enumerate(poses):
            beams = beams_of(angles, ring.ranges(pose, angles, 20.0), IDENTITY, 80.0, 3.0)
            relative = poses[0].between(pose).array()
            nodes.append(ScanNode(beams, ScanFeatures.of(beams, 40.0), 0, relative, np.zeros(3), np.eye(3)))
            submap.nodes.append(k)
        return SubmapView(submap, nodes, 10_000_000)

    return view


def stretch(x: float, y: float, yaw: float) -> list[SE2]:
    return [SE2(x + 0.5 * k * np.cos(yaw), y + 0.5 * k * np.sin(yaw), yaw) for k in range(6)]


def test_a_closure_is_found_far_from_the_prediction(view_at) -> None:
    a, b = stretch(2.0, 1.3, 0.0), stretch(3.2, 1.5, 0.1)
    true = a[0].between(b[0]).array()
    found = find_closure(
        0, 5, view_at(a), view_at(b), true + np.array([1.5, -1.2, 0.2]), np.diag([0.7, 0.7, 0.1]) ** 2
    )
    assert found is not None
    assert found.measured == pytest.approx(true, abs=0.05)


def test_verification_sees_walls_in_free_space(view_at) -> None:
    a, b = stretch(2.0, 1.3, 0.0), stretch(3.2, 1.5, 0.1)
    true = a[0].between(b[0])
    assert verify(view_at(a), view_at(b), true.array()).is_good
    assert not verify(view_at(a), view_at(b), (true @ SE2(0.0, 1.0, 0.0)).array()).is_good
    assert not verify(view_at(a), view_at(b), (true @ SE2(0.0, 0.0, 0.5)).array()).is_good


def straight_graph(n: int) -> SubmapGraph:
    graph = SubmapGraph(np.zeros(3))
    for k in range(n - 1):
        turn = np.pi / 2 if k in (5, 10, 15) else 0.0
        graph.append(np.array([5.0, 0.0, turn]), np.diag([1e-4, 1e-4, 1e-6]))
    return graph


def measured(graph: SubmapGraph, of: int, to: int, error=(0.0, 0.0, 0.0)) -> Closure:
    pose = SE2.of(graph.chain[of]).between(SE2.of(graph.chain[to])) @ SE2(*error)
    return Closure(of, to, pose.array(), CERTAIN)


def test_a_closure_that_contradicts_the_others_is_left_out() -> None:
    graph, consistency = straight_graph(24), Consistency()
    good = [measured(graph, k, 19 + k) for k in range(1, 4)]
    false = measured(graph, 0, 20, (5.0, 2.0, 0.3))
    for closure in (false, *good):
        consistency.add(closure, graph)
    assert consistency.consistent() == good, "the first one found is outvoted"


def test_a_false_closure_is_taken_back_when_others_contradict() -> None:
    graph, closer = straight_graph(24), LoopCloser(10_000_000)
    false = measured(graph, 0, 19, (0.15, -0.15, 0.03))
    closer.accept([false], graph)
    assert closer.closures == [false], "alone it fits what odometry allows"
    good = [measured(graph, k, 19 + k) for k in range(1, 5)]
    closer.accept(good, graph)
    assert closer.closures == good
    assert graph.origins == pytest.approx(graph.chain, abs=1e-3)


def test_covariances_grow_along_the_path_until_a_closure() -> None:
    graph = straight_graph(24)
    near, far = graph.relative_covariances(0, [2, 20])
    assert 0.0 < near[0, 0] < far[0, 0]
    graph.close([measured(graph, 0, 20)])
    (closed,) = graph.relative_covariances(0, [20])
    assert np.trace(closed) < 0.1 * np.trace(far)


def test_views_are_discarded(view_at, ring, angles) -> None:
    beams = beams_of(angles, ring.ranges(SE2(3.0, 1.3, 0.0), angles, 20.0), IDENTITY, 80.0, 3.0)
    nodes = [ScanNode(beams, ScanFeatures.of(beams, 40.0), 0, np.zeros(3), np.zeros(3), np.eye(3))]
    submaps, views = [Submap(nodes=[0]) for _ in range(30)], SubmapViews(10_000_000)
    first = views.get(0, submaps, nodes)
    assert views.get(0, submaps, nodes) is first
    for k in range(30):
        views.get(k, submaps, nodes)
    assert views.get(0, submaps, nodes) is not first
