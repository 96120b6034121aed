"""Localization error of a robot that turns at its limit, by what its lidar measures and whether scans are deskewed.

`python bench/bench_scan_skew.py --seeds 1,3,5`: position (m) and heading (degrees) of AMCL on the true map, their
median and 95th percentile, for a lidar that takes all beams at once (snapshot), one that turns (sweep), and one that
turns whose scans do not say so (skewed).
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import msgspec
import numpy as np
from numpy.typing import NDArray

from chefbot.demo.score import Scorer
from chefbot.demo.summary import mapping_sensor_height
from chefbot.launcher.session import session, start
from chefbot.maths.angles import wrap
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.proving.simulated_run import with_simulator_params
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.sim import device
from chefbot.sim.lidar_scans import SimulatedScans
from chefbot.sim.world.floor_plan import floor_plan
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import save_map

COMMAND_PERIOD_NS = 50_000_000
SETTLING = 10.0
"""Time before the errors count, s."""
MODES = ("snapshot", "sweep", "skewed")


class SkewedScans(SimulatedScans):
    """Scans of a turning lidar whose driver leaves the time increment out."""

    def advance(self, now_ns: int) -> list[LaserScan]:
        """Return the scans with the time increment 0."""
        return [msgspec.structs.replace(scan, time_increment=0.0) for scan in super().advance(now_ns)]


def true_map(robot: str, folder: Path) -> Path:
    """Write the true map of the room and return its path."""
    spec = load_robot(robot)
    path = folder / "map.yaml"
    save_map(path, floor_plan(load_any_world("room", spec), mapping_sensor_height(spec)))
    return path


def errors(
    mode: str, robot: str, seed: int, seconds: float, v: float, w: float, folder: Path
) -> NDArray[np.float64]:
    """Return errors of position, m, and heading, rad, (n, 2) while the robot turns with a twist (v, w)."""
    given = {"world": "room", "robot": robot, "headless": "true", "pictures": "0", "wire": "off"}
    given |= {"seed": str(seed), "people": "0", "lidar": "snapshot" if mode == "snapshot" else "sweep"}
    given |= {"map_file": str(true_map(robot, folder))}
    start_pose = load_any_world("room", load_robot(robot)).start
    given |= {f"initial_pose_{key}": str(value) for key, value in zip("xya", start_pose, strict=True)}
    launch = with_simulator_params(load_launch("amcl_demo", given), {"map_frame": "world"})
    scans = SkewedScans if mode == "skewed" else SimulatedScans
    with (
        patch.object(device, "SimulatedScans", scans),
        session(load_robot(robot), seed, "simulation", 0.0, None) as system,
    ):
        scorer = Scorer(system, {})
        scorer.phase = "delivering"
        system.loop.add_observer(scorer)
        start(system, launch)

        def command() -> None:
            sign = 1.0 if system.loop.now_ns // 20_000_000_000 % 2 else -1.0
            system.loop.publish("cmd_vel_teleop", Twist.of(v, sign * w), "person", from_device=True)
            system.loop.schedule(system.loop.now_ns + COMMAND_PERIOD_NS, 0, command)

        system.loop.post(command)
        system.loop.run(until_ns=round(seconds * 1e9))
    track = scorer.delivering
    rows = [
        (a.distance(b), abs(wrap(a.yaw - b.yaw)))
        for time, a, b in zip(track.times, track.truth, track.estimate, strict=True)
        if time > SETTLING
    ]
    return np.array(rows)


def main() -> None:
    """Print the figures of each mode."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1,3,5")
    parser.add_argument("--robot", default="chefbot_lidar")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--speed", type=float, default=0.0)
    parser.add_argument("--turn", type=float, default=1.2)
    options = parser.parse_args()
    for mode in MODES:
        seeds = [int(seed) for seed in options.seeds.split(",")]
        twist = options.speed, options.turn
        with TemporaryDirectory() as folder:
            found = [errors(mode, options.robot, s, options.seconds, *twist, Path(folder)) for s in seeds]
        both = np.concatenate(found)
        middle, p95 = np.median(both, axis=0), np.quantile(both, 0.95, axis=0)
        print(
            f"{mode:9} {len(both):5} samples: position {middle[0]:.4f} m, p95 {p95[0]:.4f}; "
            f"heading {np.degrees(middle[1]):.3f} degrees, p95 {np.degrees(p95[1]):.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
