"""Simultaneous localization and mapping with submaps and a pose graph.

Hess, Kohler, Rapp, Andor: Real-Time Loop Closure in 2D LIDAR SLAM, ICRA 2016. Each scan is matched against the
submap under construction. Finished submaps are compared with earlier ones; closures bend the graph of their frames.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from chefbot.errors import OdometryError, ScanError
from chefbot.maths.angles import wrap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.graph.adjustment import Adjustment
from chefbot.slam.graph.closures import ClosureResidual
from chefbot.slam.graph.drawn_map import DrawnMap
from chefbot.slam.graph.edges import Array, Edges, edge
from chefbot.slam.graph.least_squares import inverse
from chefbot.slam.graph.loop_closer import LoopCloser
from chefbot.slam.graph.odometry_model import OdometryModel, odometry_edges, rotated
from chefbot.slam.graph.params import GraphSlamParams
from chefbot.slam.graph.range_calibration import RangeCalibration, has_wide_view
from chefbot.slam.graph.scan_features import ScanFeatures
from chefbot.slam.graph.submap import Match, ScanNode, Submap
from chefbot.slam.graph.submap_graph import KERNEL, SubmapGraph, closure_information
from chefbot.slam.graph.surface_grid import SurfaceGrid
from chefbot.slam.motion_model import OdometryStep, compose
from chefbot.slam.scan_beams import Beams, beams_of

_MAX_COORDINATE = 1e6
"""Limit of plausible odometry coordinates, m."""
_MAX_JUMP = 100.0
"""Distance between two scans in m that no robot drives: beyond it the odom frame must have been reset."""
_SEARCHES_PER_SCAN = 2
"""Number of loop searches after a scan: the time for one scan is bounded."""
_MIN_INLIERS = 0.4
"""Share of inliers from which a match shows how good odometry is."""
_POOR_INLIERS, _GAIN = 0.35, 0.05
"""Share of inliers below which a match is repeated in a larger window, and the gain that makes that one count."""
_NO_INLIERS = 0.2
"""Share of inliers up to which a match gives no information at all."""
_SLIP = np.array([0.3, 0.3, 0.2])
"""Standard deviation of odometry when a wheel slips, m and rad."""
_CALIBRATION_NODES = 5
"""Number of latest nodes that a scan's ranges are compared with."""


class GraphSlam:
    """Simultaneous localization and mapping from laser scans and odometry (Hess et al. 2016).

    sensor: pose of the laser in the base frame. initial: pose of the robot in the map frame at the first scan.
    The result depends on the scans alone: nothing is drawn at random.
    """

    def __init__(self, params: GraphSlamParams, sensor: SE2 = IDENTITY, initial: SE2 = IDENTITY) -> None:
        self._params = params
        self._sensor = sensor
        self._odometry = OdometryModel(params)
        self._calibration = RangeCalibration()
        self._calibrates_ranges = False
        """Whether the laser's field of view is wide enough for it, as of the latest scan."""
        self._nodes: list[ScanNode] = []
        self._submaps = [Submap(grid=SurfaceGrid(params.max_cells))]
        self._graph = SubmapGraph(initial.array())
        self._loops = LoopCloser(params.max_cells)
        self._adjusted: Array | None = None
        self._drawn = DrawnMap(params.resolution, params.max_cells)
        self._range_offset = 0.0
        self._odom: SE2 | None = None
        self._processed_odom = IDENTITY
        self._step = OdometryStep()
        self._relocation: tuple[SE2, Array] | None = None

    def relocate(self, pose: SE2, std_xy: float, std_yaw: float) -> None:
        """Continue the map with another drive, at whose next scan the robot is near `pose` in the map frame.

        std_xy, std_yaw: standard deviations of that pose, m and rad. A submap begins there; loop closures with
        earlier ones correct it.
        """
        covariance = np.diag([std_xy, std_xy, std_yaw]) ** 2
        self._adjusted = None
        self._relocation = SE2.of(self._poses()[-1]).between(pose), covariance
        self._submaps[-1].grid = None
        self._submaps.append(Submap(grid=SurfaceGrid(self._params.max_cells)))
        self._graph.append(SE2.of(self._graph.origins[-1]).between(pose).array(), covariance)
        self._loops.enqueue(len(self._submaps) - 2, self._graph, self._submaps)
        self._odom, self._step = None, OdometryStep()

    def retune(self, params: GraphSlamParams) -> None:
        """Replace thresholds, ranges and noise from the next scan on; the map's geometry must not change."""
        self._params = params
        self._odometry.retune(params)

    def update(
        self, angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2, range_max: float = math.inf
    ) -> bool:
        """Process a scan and return whether it was used: a scan is used after enough motion.

        angles: (n,) rad in the laser frame. ranges: (n,) m. odom: pose of the robot in the odom frame. +inf and
        ranges of at least `range_max` mean no return; NaN, -inf and ranges not above 0 are invalid (REP-117).

        Raise OdometryError if the odometry is implausible, ScanError if the arrays differ in length, MapSizeError if
        the map would become too large. Raise OdometryError also if odometry jumps; the robot then keeps its pose
        in the map and the odom frame is taken as reset.
        """
        self._validate_input(angles, ranges, odom)
        if self._odom is not None and (jump := self._odom.distance(odom)) > _MAX_JUMP:
            # The odom frame was reset: keep the motion since the last processed scan
            self._processed_odom = odom @ self._odom.between(self._processed_odom)
            self._odom = odom
            raise OdometryError(
                f"odometry jumped by {jump:.6g} m between two scans: treated as an odometry reset"
            )
        if self._odom is not None:
            self._step.add(self._odom.between(odom))
        self._odom = odom
        if self._nodes and self._relocation is None and not self._step.is_enough(self._params):
            return False
        # REP-117: a range beyond the maximum is no return
        ranges = np.where(ranges >= range_max, np.float32(np.inf), ranges)
        beams = beams_of(angles, ranges, self._sensor, self._params.max_range, self._params.clear_range)
        self._calibrates_ranges = has_wide_view(angles)
        self._process(beams)
        self._processed_odom = odom
        self._step = OdometryStep()
        return True

    @staticmethod
    def _validate_input(angles: NDArray[np.float32], ranges: NDArray[np.float32], odom: SE2) -> None:
        if not all(abs(v) < _MAX_COORDINATE for v in odom):
            raise OdometryError(f"odometry {tuple(odom)} is implausible: check the encoders and the log")
        if np.shape(angles) != np.shape(ranges) or np.ndim(ranges) != 1:
            raise ScanError(
                f"a scan has {np.shape(angles)} angles and {np.shape(ranges)} ranges: give one for each beam"
            )

    def _process(self, beams: Beams) -> None:
        self._adjusted = None
        features = ScanFeatures.of(beams, self._params.match_range, self._calibration.offset)
        if not self._nodes:
            self._add(beams, features, np.zeros(3), IDENTITY, np.zeros((3, 3)))
            return
        if self._relocation is not None:
            (motion, covariance), self._relocation = self._relocation, None
            self._add(beams, features, np.zeros(3), motion, covariance)
            return
        # 1. Scan-to-submap matching, with odometry as the prior
        match, covariance = self._match(features)
        certain = float(np.clip((match.inliers - _NO_INLIERS) / (_POOR_INLIERS - _NO_INLIERS), 0.0, 1.0))
        posterior = inverse(inverse(covariance) + certain * match.information)
        if certain < 1.0:
            self._submaps[-1].added_covariance += posterior
        # 2. Noise of odometry and offset of the ranges
        self._learn(match, covariance, posterior)
        # 3. The scan becomes a node and part of the submap
        last_yaw = float(self._nodes[-1].pose[2])
        self._add(beams, features, match.pose, self._step.motion, rotated(covariance, -last_yaw))
        if self._calibrates_ranges:
            self._calibrate_ranges()
        # 4. A submap of full length is finished; loops are searched a few at a time
        self._submaps[-1].travel += self._step.travel
        if self._submaps[-1].travel >= self._params.submap_travel:
            self._finish_submap(posterior)
        self._loops.search(self._graph, self._submaps, self._nodes, _SEARCHES_PER_SCAN)

    def _calibrate_ranges(self) -> None:
        latest = [node for node in self._nodes[-_CALIBRATION_NODES:] if node.submap == self._nodes[-1].submap]
        self._calibration.observe(
            [node.features for node in latest], np.array([node.pose for node in latest])
        )

    def _match(self, features: ScanFeatures) -> tuple[Match, Array]:
        """Match a scan near the pose that odometry predicts; return the match and the covariance (3, 3) of odometry.

        Errors of odometry have long tails: wheels slip. A scan that fits nothing is searched in a larger window.
        """
        last = SE2.of(self._nodes[-1].pose)
        prior = (last @ self._step.motion).array()
        covariance = rotated(self._odometry.covariance(self._step), last.yaw)
        beams = self._params.independent_beams
        match = self._submaps[-1].match(features, prior, covariance, beams)
        if match.inliers >= _POOR_INLIERS:
            return match, covariance
        wide = np.diag(_SLIP**2) + covariance
        again = self._submaps[-1].match(features, prior, wide, beams)
        return (again, wide) if again.inliers > match.inliers + _GAIN else (match, covariance)

    def _learn(self, match: Match, covariance: Array, posterior: Array) -> None:
        """Compare odometry with a good match, in the axes of the last pose."""
        if match.inliers < _MIN_INLIERS:
            return
        last = SE2.of(self._nodes[-1].pose)
        before, after = (np.diag(rotated(c, -last.yaw)) for c in (covariance, posterior))
        self._odometry.observe(
            self._step, last.between(SE2.of(match.pose)), np.clip(1.0 - after / before, 0.0, 1.0)
        )

    def _add(
        self, beams: Beams, features: ScanFeatures, pose: Array, motion: SE2, motion_covariance: Array
    ) -> None:
        submap = self._submaps[-1]
        submap.nodes.append(len(self._nodes))
        node = ScanNode(beams, features, len(self._submaps) - 1, pose, motion.array(), motion_covariance)
        self._nodes.append(node)
        submap.insert(features, pose)

    def _finish_submap(self, covariance: Array) -> None:
        """Begin a submap at the last node; the later half of the finished one's nodes overlaps."""
        finished, last = self._submaps[-1], self._nodes[-1]
        origin = SE2.of(last.pose)
        submap = Submap(grid=SurfaceGrid(self._params.max_cells))
        for k in finished.nodes[len(finished.nodes) // 2 :]:
            pose = origin.between(SE2.of(self._nodes[k].pose)).array()
            submap.insert(self._nodes[k].features, pose)
            submap.overlap.append((k, pose))
        # The last node is the first of the new submap
        submap.overlap.pop()
        submap.nodes.append(finished.nodes.pop())
        finished.grid = None
        self._submaps.append(submap)
        self._graph.append(origin.array(), covariance + finished.added_covariance)
        last.submap, last.pose = len(self._submaps) - 1, np.zeros(3)
        self._loops.enqueue(len(self._submaps) - 2, self._graph, self._submaps)

    def finish(self) -> None:
        """Make all loop searches that are left and adjust all poses jointly: call it at the end of a recording."""
        while self._loops.pending:
            self._loops.search(self._graph, self._submaps, self._nodes, self._loops.pending)
        if len(self._nodes) < 2:
            return
        adjustment = Adjustment([node.features for node in self._nodes], self._calibrates_ranges)
        held = Edges.concatenated([self._odometry_edges(), self._closure_edges()])
        self._adjusted = adjustment.adjusted(self._poses(), lambda _: held)
        self._drawn = DrawnMap(self._params.resolution, self._params.max_cells)  # all at their final poses
        self._range_offset = adjustment.range_offset

    def _odometry_edges(self) -> Edges:
        steps = self._nodes[1:]
        motions = np.array([node.motion for node in steps])
        return odometry_edges(motions, np.array([node.motion_covariance for node in steps]))

    def _closure_edges(self) -> Edges:
        """Return the closures as edges between the first nodes of their submaps."""
        parts = [Edges.empty()]
        for closure in self._loops.closures:
            a, b = (self._submaps[k].nodes[0] for k in (closure.of, closure.to))
            start, end = SE2.of(self._nodes[a].pose), SE2.of(self._nodes[b].pose)
            measured = start.inverse() @ SE2.of(closure.measured) @ end
            information = rotated(closure_information(closure), -start.yaw)
            parts.append(edge(a, b, measured.array(), information, KERNEL))
        return Edges.concatenated(parts)

    def _poses(self) -> Array:
        """Return the poses (n, 3) of the nodes in the map frame."""
        if self._adjusted is not None:
            return self._adjusted
        if not self._nodes:
            return np.zeros((0, 3))
        origins = self._graph.origins[[node.submap for node in self._nodes]]
        return compose(origins, np.array([node.pose for node in self._nodes]))

    @property
    def range_offset(self) -> float:
        """The correction of all ranges that was found, m."""
        return self._range_offset if self._adjusted is not None else self._calibration.offset

    def closures(self) -> list[ClosureResidual]:
        """Return the loop closures that are applied, between processed scans."""
        edges, poses = self._closure_edges(), self._poses()
        residuals = []
        for of, to, measured in zip(edges.of.tolist(), edges.to.tolist(), edges.measured, strict=True):
            error = SE2.of(measured).between(SE2.of(poses[of]).between(SE2.of(poses[to])))
            residuals.append(ClosureResidual(of, to, math.hypot(error.x, error.y), abs(wrap(error.yaw))))
        return residuals

    @property
    def map_T_odom(self) -> SE2:  # noqa: N802  REP-105's frames read left to right
        """Pose of the odom frame in the map frame; updated by processed scans only."""
        if not self._nodes:
            return SE2.of(self._graph.origins[0])
        last = self._nodes[-1]
        pose = compose(self._graph.origins[last.submap][None], last.pose)[0]
        x, y, yaw = self._adjusted[-1] if self._adjusted is not None else pose
        return SE2(float(x), float(y), wrap(float(yaw))) @ self._processed_odom.inverse()

    @property
    def pose(self) -> SE2:
        """Pose of the robot in the map frame at the latest odometry."""
        return self.map_T_odom @ (IDENTITY if self._odom is None else self._odom)

    def trajectory(self) -> list[SE2]:
        """Return the poses of the robot in the map frame at all processed scans."""
        return [SE2(x, y, wrap(yaw)) for x, y, yaw in self._poses().tolist()]

    def map(self) -> Grid:
        """Return the occupancy grid of all scans at their present poses, cropped to the observed area."""
        return self._drawn.draw([node.beams for node in self._nodes], self._poses(), self.range_offset)
