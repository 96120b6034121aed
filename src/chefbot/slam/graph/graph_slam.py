"""Simultaneous localization and mapping with submaps and a pose graph.

Hess, Kohler, Rapp, Andor: Real-Time Loop Closure in 2D LIDAR SLAM, ICRA 2016.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import OdometryError, ScanError
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.odometry_model import OdometryModel, rotated
from chefbot.slam.graph.pose_graph import Edges
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.graph.submap import Match, Node, Submap
from chefbot.slam.graph.surface_grid import SurfaceGrid
from chefbot.slam.graph.submap_graph import SubmapGraph, MAX_DISTANCE
from chefbot.slam.graph.submap_view import SubmapViews
from chefbot.slam.graph.closures import find_closure
from chefbot.slam.motion_model import OdometryStep
from chefbot.slam.occupancy_accumulator import OccupancyAccumulator
from chefbot.slam.scan_beams import Beams, beams_of

Array = NDArray[np.float64]
_MAX_COORDINATE = 1e6
_MAX_JUMP = 100.0


class GraphSlam:
    def __init__(self, params: GraphSlamParams, sensor: SE2 = IDENTITY, initial: SE2 = IDENTITY) -> None:
        self._params = params
        self._sensor = sensor
        self._odometry = OdometryModel(params)
        self.nodes: list[Node] = []
        self.submaps: list[Submap] = []
        self.graph = SubmapGraph(initial.array())
        self._views = SubmapViews(params.max_cells)
        self.candidates = []
        self.accepted = []
        self.searches = 0
        self.steps = []
        self._initial = initial
        self._odom: SE2 | None = None
        self._step = OdometryStep()
        self.scans = 0
        self.log = []

    def update(self, angles, ranges, odom: SE2, range_max: float = math.inf) -> bool:
        first = self._odom is None
        if not first:
            self._step.add(self._odom.between(odom))
        self._odom = odom
        m = self._step.motion
        self.scans += 1
        if not first and math.hypot(m.x, m.y) < self._params.linear_update and abs(m.yaw) < self._params.angular_update:
            return False
        ranges = np.where(ranges >= range_max, np.float32(np.inf), ranges)
        beams = beams_of(angles, ranges, self._sensor, self._params.max_range, self._params.clear_range)
        features = ScanFeatures.of(beams, self._params.match_range)
        if first:
            self.submaps.append(Submap(grid=SurfaceGrid(self._params.max_cells)))
            self._add(beams, features, np.zeros(3), np.zeros((3, 3)))
        else:
            self._track(beams, features)
        self._step = OdometryStep()
        return True

    def _track(self, beams, features):
        last = SE2.of(self.nodes[-1].pose)
        prior = last @ self._step.motion
        covariance = rotated(self._odometry.covariance(self._step), last.yaw)
        submap = self.submaps[-1]
        match = submap.match(features, prior.array(), covariance, self._params.independent_beams)
        posterior = np.linalg.inv(np.linalg.inv(covariance) + match.information)
        certainty = 1.0 - np.diag(rotated(posterior, -last.yaw)) / np.diag(rotated(covariance, -last.yaw))
        self._odometry.observe(self._step, last.between(SE2.of(match.pose)), np.clip(certainty, 0, 1) if match.inliers > 0.5 else np.zeros(3))
        self.log.append((match.inliers, *np.sqrt(np.diag(posterior)), *self._odometry.scale, *(np.array(last.between(SE2.of(match.pose)))-np.array(self._step.motion))))
        self._add(beams, features, match.pose, posterior)
        self.steps.append((self._step.motion.array(), self._odometry.covariance(self._step)))
        submap.travel += math.hypot(self._step.motion.x, self._step.motion.y)
        if submap.travel > self._params.submap_travel:
            self._next_submap()

    def _add(self, beams: Beams, features: ScanFeatures, pose: Array, covariance: Array) -> None:
        submap = self.submaps[-1]
        submap.nodes.append(len(self.nodes))
        self.nodes.append(Node(self.scans, beams, features, self._odom.array(), len(self.submaps) - 1, pose, covariance))
        submap.grid.add(features.outline, pose)

    def _next_submap(self) -> None:
        old = self.submaps[-1]
        origin = SE2.of(self.nodes[-1].pose)
        new = Submap(grid=SurfaceGrid(self._params.max_cells))
        for k in old.nodes[len(old.nodes) // 2 :]:
            pose = origin.between(SE2.of(self.nodes[k].pose)).array()
            new.overlap.append((k, pose))
            new.grid.add(self.nodes[k].features.outline, pose)
        old.grid = None
        self.submaps.append(new)
        self.graph.append(origin.array(), self.nodes[-1].covariance)
        # The last node is in both
        self.nodes[-1].submap, self.nodes[-1].pose = len(self.submaps) - 1, np.zeros(3)
        old.nodes.pop()
        new.overlap.pop()
        new.nodes.append(len(self.nodes) - 1)
        self._close_loops(len(self.submaps) - 2)

    def _close_loops(self, query: int) -> None:
        others = [k for k in range(query - 1) if np.hypot(*(self.graph.origins[k] - self.graph.origins[query])[:2]) < 40]
        if not others: return
        covs = self.graph.relative_covariances(query, others)
        o = self.graph.origins
        cands = []
        for k, cov in zip(others, covs):
            sig = math.sqrt(max(cov[0,0], cov[1,1]))
            d = np.hypot(*(o[k]-o[query])[:2])
            if d < 10 + 2*sig: cands.append((d/(10+2*sig), k, cov))
        found = False
        for _, k, cov in sorted(cands, key=lambda c: c[:2])[:8]:
            self.searches += 1
            a, b = self._views.get(k, self.submaps, self.nodes), self._views.get(query, self.submaps, self.nodes)
            pred = SE2.of(o[k]).between(SE2.of(o[query])).array()
            # covariance in the frame of the target: as seen from query, moved
            sig = math.sqrt(max(cov[0,0],cov[1,1]))
            c = find_closure(k, query, a, b, pred, np.diag([sig**2, sig**2, cov[2,2]]))
            if c is None: continue
            self.candidates.append(c)
            if c.verdict.is_good: found = True
        if found:
            self.accepted = [c for c in self.candidates if c.verdict.is_good]
            self.graph.close(self.accepted)
            for _ in range(3):
                dist = self.graph.closure_distances()
                if (dist <= MAX_DISTANCE).all(): break
                self.accepted = [c for c, d in zip(self.accepted, dist) if d <= MAX_DISTANCE]
                self.graph.close(self.accepted)

    def poses(self) -> Array:
        return np.array([(SE2.of(self.graph.origins[n.submap]) @ SE2.of(n.pose)).array() for n in self.nodes])

    def odometry_edges(self) -> Edges:
        n = len(self.nodes) - 1
        return Edges(np.arange(n), np.arange(1, n + 1), np.array([m for m, _ in self.steps]),
                     np.linalg.inv(np.array([c for _, c in self.steps])), np.full(n, np.inf))

    def trajectory(self):
        return [SE2.of(p) for p in self.poses()]

    def map(self) -> Grid:
        canvas = OccupancyAccumulator(self._params.resolution, self._params.max_cells)
        for node, pose in zip(self.nodes, self.poses(), strict=True):
            canvas.add_scan(node.beams, pose)
        return canvas.grid()
