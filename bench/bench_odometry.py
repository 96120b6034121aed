"""Odometry: drift on a tour of the hotel with and without gyro, and the time of one update.

Every run is a robot that differs from its file (standard deviations): diameters by 0.3 %, separation by
0.5 %, slipping wheels, gyro noise and offset from the robot file.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from chefbot.maths.angles import wrap
from chefbot.robot.load import load_robot

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "odometry"))
from imperfect_robot import RATE, Faults, drive, hotel_drive
from synchronous import SynchronousEkf

ROBOT = load_robot("chefbot")
RUNS = 40


def drift(metres: float, gyro_gain: float, with_gyro: bool) -> tuple[float, float, float, float]:
    """Return median and 90 % position error (m), RMS yaw error (deg), mean NEES of RUNS runs."""
    commands, rows = hotel_drive(metres=metres), []
    for seed in range(RUNS):
        odometry = SynchronousEkf(ROBOT)
        for r in drive(ROBOT, commands, Faults(gyro_gain=gyro_gain), np.random.default_rng(seed)):
            estimate = odometry.update(r.left, r.right, 1.0 / RATE, r.gyro_z if with_gyro else None)
        yaw = wrap(estimate.pose.yaw - r.truth.yaw)
        e = np.array([estimate.pose.x - r.truth.x, estimate.pose.y - r.truth.y, yaw])
        rows.append((r.truth.distance(estimate.pose), yaw, e @ np.linalg.solve(estimate.covariance, e)))
    distance, yaws, nees = np.array(rows).T
    rms = float(np.degrees(np.sqrt(np.mean(yaws**2))))
    return float(np.median(distance)), float(np.quantile(distance, 0.9)), rms, float(nees.mean())


def update_times(with_gyro: bool, repeats: int = 7, updates: int = 4000) -> list[float]:
    """Return the CPU time per update, with its estimate, in us for each repetition."""
    times = []
    for _ in range(repeats):
        odometry = SynchronousEkf(ROBOT)
        gyro = 0.01 if with_gyro else None
        began = time.process_time()
        for k in range(updates):
            odometry.update(80 * k, 81 * k, 1.0 / RATE, gyro)
        times.append((time.process_time() - began) / updates * 1e6)
    return times


def main() -> None:
    """Print the tables."""
    print(f"{RUNS} runs each       position error m      yaw error deg   NEES (expected: 3)")
    print("                       median     90 %       rms")
    for metres in (10.0, 20.0, 40.0):
        for name, gain, with_gyro in (
            ("wheels", 0.0, False),
            ("gyro", 0.0, True),
            ("gyro, gain 1 % off", 0.01, True),
        ):
            median, p90, yaw, nees = drift(metres, gain, with_gyro)
            print(f"{metres:3.0f} m {name:18s} {median:7.3f} {p90:7.3f} {yaw:10.2f} {nees:12.1f}")
    print("\nCPU time of one update with its estimate, microseconds: median, min")
    for name, with_gyro in (("wheels", False), ("wheels and gyro", True)):
        times = update_times(with_gyro)
        print(f"{name:18s} {np.median(times):7.1f} {min(times):7.1f}")


if __name__ == "__main__":
    main()
