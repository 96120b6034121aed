"""Speed of the whole robot: simulator, base, mapping and navigation during exploration, and cost by callback.

Run: python bench/bench_stack.py [--world hotel] [--seconds 60] [--profile]
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console

from chefbot.kernels.precompile import compile_kernels
from chefbot.launcher.session import session, start
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import CallbackStatistics
from chefbot.runtime.node_container import NodeContainer

TARGETS = {"chefbot_lidar": 8.0, "chefbot": 3.0}
"""Real-time factor on two cores."""
SHOWN = 14
SETTLE = 5.0
"""Robot time before the measurement, for loading and initialization, s."""


def run(robot: str, world: str, seconds: float, profile: bool) -> None:
    """Explore with a recording as in the demo, and print the times."""
    with tempfile.TemporaryDirectory() as folder:
        record = Path(folder) / "run.mcap"
        with session(load_robot(robot), 1, "simulation", 0.0, record) as system:
            given = {"world": world, "headless": "true", "pictures": "0", "robot": robot, "keep_map": "false"}
            start(system, load_launch("explore", given))
            system.loop.run(until_ns=round(SETTLE * 1e9))
            for timing in system.loop.timings.values():
                timing.calls = timing.total_ns = timing.worst_ns = 0
            profiler = cProfile.Profile() if profile else None
            wall, cpu = go_on(system, seconds, profiler)
            print_factor(robot, world, seconds, wall, cpu)
            print_handlers(system.loop.timings, seconds, wall)
            if profiler is not None:
                pstats.Stats(profiler, stream=sys.stdout).sort_stats("tottime").print_stats(40)


def go_on(system: NodeContainer, seconds: float, profiler: cProfile.Profile | None) -> tuple[float, float]:
    """Return (wall time, CPU time of all threads) for a duration of robot time."""
    until = system.loop.now_ns + round(seconds * 1e9)
    wall, cpu = time.perf_counter(), time.process_time()
    if profiler is None:
        system.loop.run(until_ns=until)
    else:
        profiler.runcall(system.loop.run, until_ns=until)
    return time.perf_counter() - wall, time.process_time() - cpu


def print_factor(robot: str, world: str, seconds: float, wall: float, cpu: float) -> None:
    """Print a line."""
    print(
        f"\n{robot} explores {world}: {seconds:.0f} s in {wall:.1f} s, {seconds / wall:.1f} x real time "
        f"(target {TARGETS[robot]:.0f}); {cpu:.1f} s of CPU time, so {seconds / cpu:.1f} x on one free core"
    )


def print_handlers(timings: dict[str, CallbackStatistics], seconds: float, wall: float) -> None:
    """Print the most expensive callbacks; `rest` is the loop itself."""
    print(f"{'callback':44}{'calls/s':>9}{'mean ms':>9}{'worst ms':>10}{'share':>8}")
    dearest = sorted(timings.items(), key=lambda item: -item[1].total_ns)
    for name, one in dearest[:SHOWN]:
        mean = one.total_ns / max(one.calls, 1) / 1e6
        share = one.total_ns / 1e9 / wall
        print(f"{name:44}{one.calls / seconds:9.1f}{mean:9.3f}{one.worst_ns / 1e6:10.1f}{share:8.1%}")
    rest = wall - sum(one.total_ns for one in timings.values()) / 1e9
    print(f"{'rest':44}{'':28}{rest / wall:8.1%}")


def main() -> None:
    """Print both robots."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", default="room")
    parser.add_argument("--robot", choices=TARGETS, default=None)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument(
        "--profile", action="store_true", help="and the dearest functions of the loop's thread"
    )
    given = parser.parse_args()
    compile_kernels(Console())
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for robot in [given.robot] if given.robot else TARGETS:
        run(robot, given.world, given.seconds, given.profile)


if __name__ == "__main__":
    main()
