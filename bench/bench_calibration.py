"""Calibration of simulated, uncalibrated robots by seed, compared with their true parameters.

    python bench/bench_calibration.py [ROBOT [FIRST_SEED LAST_SEED [SQUARES]]]

Then the odometry of calibrated robots with the profile `real` over 40 m in the hotel (bench_odometry_hotel.py
samples the calibration; here it is the result of `chefbot robot calibrate` for the same robot).
"""

from __future__ import annotations

import json
import math
import sys
import time
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.cli.robot.calibrate import CalibrateOptions, run_calibrate
from chefbot.errors import ChefbotError
from chefbot.odometry.drive_model import DriveModel
from chefbot.odometry.ekf import Ekf
from chefbot.odometry.params import OdometryParams
from chefbot.robot.load import load_robot

sys.path.insert(0, str(Path(__file__).parent))
import bench_odometry_hotel as hotel

OUT = Path("runs/bench_calibration")
WHEEL, SEPARATION, GYRO, LESS = 0.001, 0.002, 0.002, 10.0
"""Bounds: relative errors of the result, and the factor by which the squares' systematic error must fall."""
HOTEL_SEEDS = range(1, 4)


def calibrated(robot: str, seed: int, profile: str, squares: int) -> dict[str, Any]:
    """Return the summary of `chefbot robot calibrate --sim` with the ground truth."""
    out = OUT / f"{robot}_{profile}_{seed}"
    begun = time.perf_counter()
    arguments = [f"profile:={profile}", f"squares:={squares}"]
    run_calibrate(CalibrateOptions(robot, arguments, True, seed, out, "calibrate"))
    summary: dict[str, Any] = json.loads((out / "calibration.json").read_text())
    return summary | {"seconds": time.perf_counter() - begun}


def off(summary: dict[str, Any], key: str) -> float:
    """Return the relative error (or error in rad) of a result."""
    truth, value = summary["truth_of_the_simulator"][key], summary["found"][key]["value"]
    return float(value - truth) if key.endswith("yaw") else float(value / truth - 1.0)


def row(seed: int, summary: dict[str, Any]) -> tuple[str, bool]:
    """Return a line of the table, and whether all bounds are met."""
    left, right, separation, gyro = (
        off(summary, key) for key in ("left_wheel", "right_wheel", "separation", "gyro_scale")
    )
    yaw = math.degrees(off(summary, next(key for key in summary["found"] if key.endswith("yaw"))))
    worst = summary["worst_return_m"]
    less = worst["before"] / worst["after"]
    kept = max(abs(left), abs(right)) <= WHEEL and abs(separation) <= SEPARATION and abs(gyro) <= GYRO
    text = (
        f"{seed:4d} {100 * left:+8.3f} {100 * right:+8.3f} {100 * separation:+8.3f} {100 * gyro:+8.3f} {yaw:+8.3f} "
        f"{1000 * worst['before']:9.0f} {1000 * worst['after']:8.1f} {1000 * worst['after_by_umbmark']:8.1f} "
        f"{less:8.0f} {summary['slipped']:5d}/{summary['drives']:<4d} {summary['seconds']:6.0f}"
    )
    return text, kept and less >= LESS


def recovered(robot: str, seeds: range, squares: int) -> bool:
    """Return the table of one robot."""
    head = " seed   left %  right %    sep. %   gyro %  yaw deg    before    after  umbmark     less  slipped    sec"
    lines, good = (
        [f"{robot}, profile assembled, {squares} squares each way; errors of what was found; mm", head],
        True,
    )
    for seed in seeds:
        try:
            text, kept = row(seed, calibrated(robot, seed, "assembled", squares))
        except ChefbotError as error:
            text, kept = f"{seed:4d} {error}", False
        lines.append(text if kept else f"{text}  beyond the bounds")
        good &= kept
        print(lines[-1], file=sys.stderr, flush=True)
    print("\n".join(lines))
    return good


def hotel_drive(robot: str, seed: int) -> tuple[float, float]:
    """Return the error in m and deg after 40 m with the calibrated file of the same robot."""
    calibrated(robot, seed, "real", 1)
    same = int(np.random.default_rng([seed, zlib.crc32(b"simulator")]).integers(2**31))
    hotel.ROBOT = load_robot(robot)
    _, sensed = hotel.drive(same)
    file = load_robot(str(OUT / f"{robot}_real_{seed}" / "robot.yaml"))
    ekf = Ekf(DriveModel.of(file, OdometryParams()))
    for one in sensed:
        ekf.add(one.imu)
        ekf.add(one.wheels)
    metres, degrees, _ = hotel.off(ekf.estimate, sensed[-1].truth)
    return metres, degrees


def main() -> None:
    """Print the tables; exit code 1 if a bound is missed."""
    robot = sys.argv[1] if len(sys.argv) > 1 else "chefbot_lidar"
    first, last = (int(text) for text in sys.argv[2:4]) if len(sys.argv) > 3 else (1, 3)
    good = recovered(robot, range(first, last + 1), int(sys.argv[4]) if len(sys.argv) > 4 else 1)
    for seed in HOTEL_SEEDS if len(sys.argv) < 3 else ():
        metres, degrees = hotel_drive(robot, seed)
        print(f"hotel, {robot} {seed}: error {metres:.3f} m and {degrees:.2f} deg after {hotel.METRES:.0f} m")
        good &= metres <= hotel.LIMIT_M and degrees <= hotel.LIMIT_DEG
    if not good:
        raise SystemExit("a bound is missed")


if __name__ == "__main__":
    main()
