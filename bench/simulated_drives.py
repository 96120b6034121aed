"""Recordings of drives through generated buildings, with their true poses: rays without physics, so it is quick."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from chefbot.buildings.generate import generate
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.demo.summary import ground_truth_map
from chefbot.maths.costs import Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner
from chefbot.planning.planner import PlanningError
from chefbot.robot.load import load_robot
from chefbot.sim.ray_kernels import cast_rays
from chefbot.sim.world.shapes import shape_arrays
from chefbot.sim.world.world import World, build_world
from chefbot.slam.recorded_scan import RecordedScan

ROBOT = load_robot("chefbot_lidar")
KINDS = ("office", "home", "hotel", "hall", "warehouse", "corridors")
LASERS = ((360.0, 360, 8.0), (270.0, 540, 20.0), (240.0, 240, 5.6))
"""Field of view in degrees, beams, and range in m."""
NOISE, STEP, TURN, SPEED = 0.01, 0.1, 0.1, 0.4
"""Of ranges, m; between scans, m and rad; of the robot, m/s."""
GLASS_COSINE = 0.98
SCALE_ERROR, TURN_ERROR, DRIFT, STEP_NOISE = 0.01, 0.02, 0.004, 0.02
"""Of odometry of usual quality, as standard deviations: of length, of angles, in rad/m; noise as a share of steps."""


class SimulatedDrive(NamedTuple):
    """A recording, the true poses of its scans, and the map that a laser would make without any error."""

    scans: list[RecordedScan]
    truth: list[SE2]
    true_map: Grid


def simulated_drive(kind: str, seed: int, error: float, length: float) -> SimulatedDrive:
    """Drive at most `length` m between the places of a building; error: of odometry, 1 for usual quality."""
    world = build_world(generate(kind, seed, {}, ROBOT.circumscribed_radius), kind)
    true_map = ground_truth_map(world, ROBOT)
    rng = np.random.default_rng([seed, 77])
    truth = list(_poses(world, true_map, rng, length))
    odometry = drifted(truth, error, rng)
    laser = LASERS[seed // 2 % len(LASERS)]
    return SimulatedDrive(list(_scans(world, truth, odometry, laser, rng)), truth, true_map)


def _poses(world: World, true_map: Grid, rng: np.random.Generator, length: float) -> Iterator[SE2]:
    costs = LayeredCostmap(CostmapParams(), ROBOT.footprint)
    costs.set_static(true_map)
    costmap, here, gone = costs.update(), world.start, 0.0
    yield here
    goals = [*(place for _ in range(2) for place in rng.permutation(sorted(world.places))), "home"]
    for name in goals:
        for pose in _driven_poses(costmap, here, world.places[str(name)]):
            gone, here = gone + here.distance(pose), pose
            yield pose
            if gone > length:
                return


def _driven_poses(costmap: Costmap, here: SE2, goal: SE2) -> Iterator[SE2]:
    """Yield poses along the planned path: turns on the spot, then straight ahead."""
    try:
        path = GridPlanner().plan(costmap, here, goal)
    except PlanningError:
        return
    for pose in path[:: max(1, round(STEP / costmap.resolution))]:
        ahead = SE2.of(pose)
        if here.distance(ahead) < STEP / 2:
            continue
        bearing = float(np.arctan2(ahead.y - here.y, ahead.x - here.x))
        turn = SE2(0.0, 0.0, bearing).between(SE2(0.0, 0.0, here.yaw)).yaw * -1.0
        steps = int(abs(turn) // TURN) + 1
        for _ in range(steps):
            here = here @ SE2(0.0, 0.0, turn / steps)
            yield here
        here = SE2(ahead.x, ahead.y, bearing)
        yield here


def drifted(truth: list[SE2], error: float, rng: np.random.Generator) -> list[SE2]:
    """Return the poses by odometry with a random error of this size, from (0, 0, 0) on."""
    scale, turn = 1.0 + error * rng.normal(size=2) * (SCALE_ERROR, TURN_ERROR)
    drift = error * float(rng.normal()) * DRIFT
    poses = [SE2(0.0, 0.0, 0.0)]
    for before, after in pairwise(truth):
        step = before.between(after)
        noise = error * STEP_NOISE * rng.normal(size=2)
        length = step.x * (scale + noise[0])
        yaw = step.yaw * (turn + noise[1]) + drift * step.x
        poses.append(poses[-1] @ SE2(length, step.y, yaw))
    return poses


def _scans(
    world: World,
    truth: list[SE2],
    odometry: list[SE2],
    laser: tuple[float, int, float],
    rng: np.random.Generator,
) -> Iterator[RecordedScan]:
    field_of_view, beams, max_range = laser
    mount = ROBOT.sensors.lidar.mount  # type: ignore[union-attr]
    on_robot = SE2(mount.x, mount.y, 0.0)
    angles = np.radians(np.linspace(-field_of_view / 2, field_of_view / 2, beams, endpoint=False))
    kind, centre, half, yaw, _, material = shape_arrays(world.shapes_at_rest())
    solids = kind, centre, half, yaw, material
    stamp = 0.0
    for k, (pose, odom) in enumerate(zip(truth, odometry, strict=True)):
        eye = pose @ on_robot
        rays = np.column_stack([np.cos(angles + eye.yaw), np.sin(angles + eye.yaw), np.zeros(beams)])
        origin = np.array([eye.x, eye.y, mount.z])
        ranges = cast_rays(solids, True, origin, rays, max_range, GLASS_COSINE)[0]
        ranges = ranges + NOISE * rng.normal(size=beams)
        measured = np.where(ranges > 0.05, ranges, np.nan).astype(np.float32)
        stamp += (truth[k - 1].distance(pose) / SPEED if k else 0.0) + 0.1
        yield RecordedScan(stamp, angles.astype(np.float32), measured, odom @ on_robot, odom)
