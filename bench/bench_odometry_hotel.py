"""Odometry over 40 m through the simulated hotel, on robots of the `real` profile, compared with ground truth.

The controller drives between tables of the hotel with the true pose, so that all filters are compared on the
same path. `calibrated` has a robot file with the true parameters of this robot plus the error of a calibration.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.control.dwa import DwaController
from chefbot.control.kinematics import wheel_speeds
from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.demo.summary import ground_truth_map
from chefbot.maths.angles import wrap
from chefbot.maths.costs import Costmap
from chefbot.maths.se2 import SE2
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.estimate import MotionEstimate
from chefbot.odometry.params import OdometryParams
from chefbot.odometry.readings import ImuReading, WheelCounts
from chefbot.planning.grid_planner import GridPlanner
from chefbot.robot.drivetrain import Calibration
from chefbot.robot.load import load_robot
from chefbot.robot.motion_limits import Limits
from chefbot.robot.spec import Robot
from chefbot.safety.velocity_limiter import VelocityLimiter
from chefbot.sim.board import SimulatedBoard
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import load_any_world

ROBOT = load_robot("chefbot")
WORLD = load_any_world("hotel", ROBOT)
METRES, RUNS, TICK_NS = 40.0, 12, 20_000_000
WHEELS, TRACK, GYRO = 0.0006, 0.0006, 0.00005
"""Standard deviations that `chefbot robot calibrate` states for the wheels, their separation and the gyro's scale."""
LIMIT_M, LIMIT_DEG = 0.01 * METRES, 2.0


class Sensed(NamedTuple):
    """One tick of a drive: sensor readings, and ground truth since the start."""

    wheels: WheelCounts
    imu: ImuReading
    truth: SE2


def random_paths(rng: np.random.Generator, costmap: Costmap, start: SE2) -> Iterator[NDArray[np.float64]]:
    """Return paths from table to table."""
    tables = [name for name in WORLD.places if name.startswith("table")]
    planner, here = GridPlanner(), start
    while True:
        goal = WORLD.places[str(rng.choice(tables))]
        if goal.distance(here) > 2.0:
            yield planner.plan(costmap, here, goal)
            here = goal


def drive(seed: int) -> tuple[Simulation, list[Sensed]]:
    """Record two seconds at rest, then METRES from table to table."""
    sim = Simulation(ROBOT, WORLD, "real", seed, people=0)
    costs = LayeredCostmap(CostmapParams(), ROBOT.footprint)
    costs.set_static(ground_truth_map(WORLD, ROBOT))
    costmap, limits = costs.update(), Limits.of(ROBOT)
    board, dwa, limiter = SimulatedBoard(ROBOT, sim), DwaController(limits), VelocityLimiter(limits)
    paths, start = random_paths(np.random.default_rng(seed), costmap, sim.truth().pose), sim.truth().pose
    sensed, gone, twist, last, tick = [], 0.0, (0.0, 0.0), start, 0
    while gone < METRES:
        tick += 1
        board.run_until(tick * TICK_NS)
        here = sim.truth().pose
        gone, last = gone + last.distance(here), here
        sensed.append(_sense(sim, start.between(here), tick))
        if tick % 5 or tick < 100:
            continue
        v, w, status = dwa.command(here, twist, costmap)
        if status.name != "RUNNING":
            dwa.set_path(next(paths))
        twist = limiter.step(v, w, 0.0, 0.1)
        board.command(*wheel_speeds(*twist, ROBOT))
    return sim, sensed


def _sense(sim: Simulation, truth: SE2, tick: int) -> Sensed:
    rates, force = (tuple(values.tolist()) for values in sim.imu())
    spec, stamp = ROBOT.sensors.imu, tick * TICK_NS
    noise = (spec.gyro_noise**2,) * 3, (spec.accelerometer_noise**2,) * 3
    return Sensed(
        WheelCounts(stamp, *sim.wheel_ticks()), ImuReading(stamp, rates, noise[0], force, noise[1]), truth
    )


def calibrated(sim: Simulation, seed: int) -> Robot:
    """Return the robot with the calibration section that a calibration would write."""
    built, rng = sim.as_built, np.random.default_rng(seed)
    true = np.array([built.left_wheel, built.right_wheel, built.separation, sim.gyro_scale])
    left, right, separation, gyro = (true + rng.normal(size=4) * (WHEELS, WHEELS, TRACK, GYRO)).tolist()
    found = Calibration(
        left_wheel=left,
        right_wheel=right,
        separation=separation,
        gyro_scale=gyro,
        wheel_deviation=WHEELS,
        separation_deviation=TRACK,
        gyro_deviation=GYRO,
    )
    return msgspec.structs.replace(ROBOT, calibration=found)


def fused(sensed: list[Sensed], robot: Robot) -> MotionEstimate:
    """Return the pose by wheels, gyro and accelerometer."""
    ekf = Ekf(DriveModel.of(robot, OdometryParams()))
    for one in sensed:
        ekf.add(one.imu)
        ekf.add(one.wheels)
    return ekf.estimate


def by_wheels(sensed: list[Sensed]) -> MotionEstimate:
    """Return the pose by the wheels of the robot file."""
    ekf = Ekf(DriveModel.of(ROBOT, OdometryParams()))
    for one in sensed:
        ekf.add(one.wheels)
    return ekf.estimate


def off(estimate: MotionEstimate, truth: SE2) -> tuple[float, float, float]:
    """Return the error in m and in degrees, and the NEES (expected: 3)."""
    x, y, yaw = estimate.pose
    error = np.array([x - truth.x, y - truth.y, wrap(yaw - truth.yaw)])
    nees = float(error @ np.linalg.solve(estimate.covariance, error))
    return math.hypot(error[0], error[1]), abs(math.degrees(error[2])), nees


def main() -> None:
    """Print the table; exit code 1 if calibrated odometry exceeds its limits."""
    rows: dict[str, list[tuple[float, float, float]]] = {"wheels": [], "fused": [], "fused, calibrated": []}
    seconds = ticks = 0.0
    for seed in range(RUNS):
        sim, sensed = drive(seed)
        truth, begun = sensed[-1].truth, time.perf_counter()
        rows["fused"].append(off(fused(sensed, ROBOT), truth))
        seconds, ticks = seconds + time.perf_counter() - begun, ticks + len(sensed)
        rows["fused, calibrated"].append(off(fused(sensed, calibrated(sim, seed)), truth))
        rows["wheels"].append(off(by_wheels(sensed), truth))
    print(
        f"{RUNS} drives of {METRES:.0f} m in the hotel; limits {LIMIT_M:.1f} m (1 %) and {LIMIT_DEG:.0f} deg"
    )
    print("                     error m           error deg        NEES")
    print("                   median    max     median    max      mean")
    for name, found in rows.items():
        m, deg, nees = np.array(found).T
        cells = f"{np.median(m):6.3f} {m.max():6.3f}   {np.median(deg):6.2f} {deg.max():6.2f}"
        print(f"{name:18s} {cells} {nees.mean():9.1f}")
    print(f"one tick with IMU: {1e6 * seconds / ticks:.0f} us (one of {os.cpu_count()} cores)")
    m, deg, _ = np.array(rows["fused, calibrated"]).T
    if m.max() > LIMIT_M or deg.max() > LIMIT_DEG:
        raise SystemExit("calibrated odometry misses its limits")


if __name__ == "__main__":
    main()
