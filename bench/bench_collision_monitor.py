"""CPU time of the collision monitor: per checked twist and per sensor message, for each robot, in a furnished hotel.

Run: python bench/bench_collision_monitor.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.sensor_fault_drive import SensorFaultDrive, straight_free_starts  # noqa: E402

from chefbot.maths.se2 import SE2  # noqa: E402
from chefbot.robot.load import load_robot  # noqa: E402
from chefbot.robot.motion_limits import Limits  # noqa: E402

ROBOTS = ("chefbot", "chefbot_lidar", "jackal", "desk")
REPETITIONS = 2000


def cpu_ms(work: Callable[[], object]) -> float:
    """Return the CPU time of one call, ms."""
    work()
    begin = time.process_time()
    for _ in range(REPETITIONS):
        work()
    return (time.process_time() - begin) / REPETITIONS * 1e3


def main() -> None:
    """Print a line for each robot."""
    print(
        f"{'robot':16}{'points':>8}{'twist, ms':>12}{'sensors, ms':>13}{'scan, ms':>11}{'obstacles, ms':>15}"
    )
    for name in ROBOTS:
        robot = load_robot(name)
        drive = SensorFaultDrive(robot, straight_free_starts("hotel", 1, 5)[0])
        node = drive.system.nodes["base"]
        monitor, limits = node._monitor, Limits.of(robot)  # type: ignore[attr-defined]
        pose = drive.system.transforms.lookup("odom", "base_link")
        now_ns, at = drive.loop.now_ns, SE2(0.0, 0.0, 0.0)
        twist = (limits.speed, 0.3)
        scan, obstacles = node.scan.last, node.obstacles.last  # type: ignore[attr-defined]
        figures = [
            cpu_ms(lambda: monitor.check(*twist, pose, now_ns, 0.1)),  # noqa: B023
            cpu_ms(node._judge_sensors),  # type: ignore[attr-defined]
            cpu_ms(lambda: monitor.process_scan(scan, at)) if scan is not None else 0.0,  # noqa: B023
            cpu_ms(lambda: monitor.process_obstacles(obstacles, at)) if obstacles is not None else 0.0,  # noqa: B023
        ]
        points = len(monitor.points(pose, now_ns, monitor.polygons.reach))
        twist_ms, sensors_ms, scan_ms, obstacles_ms = figures
        print(
            f"{name:16}{points:8}{twist_ms:12.3f}{sensors_ms:13.3f}{scan_ms:11.3f}{obstacles_ms:15.3f}",
            flush=True,
        )
        drive.system.stop()


if __name__ == "__main__":
    main()
