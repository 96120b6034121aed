"""Effect of the death of a worker process on a delivery, and start and stop of processes, at real time.

A lidar robot in a small simulated room, with the processes of `chefbot demo --processes`, drives to a table; on the
way each process in turn gets a `kill -9`. `stopped` is the robot's time from its last command before the kill to the
first stop command, `back` the wall time until every node of the process is on the wire again. Every kill counts. The
last row is a launch's own process, which `--supervised` starts again; its wheels are stopped by the board
(tests/chaos/test_killed_launch.py).

Run: python bench/bench_processes.py [TIMES]
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chefbot.demo.processes import PROCESSES

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.delivery_launch import ProcessFault, localized_robot  # noqa: E402
from tests.chaos.launch_process import HERE, run_chefbot, run_launch_file, wait_for  # noqa: E402
from tests.support.processes import children_of, is_alive  # noqa: E402

ARRIVED_M = 0.35
STOP_MS, BACK_S, SHUT_S = 200.0, 5.0, 3.0


class Death(NamedTuple):
    """The consequences of one kill."""

    stopped_ms: float
    back_s: float


def deaths_on_a_delivery() -> tuple[dict[str, Death], bool]:
    """Kill each process once on the way to a table; return the consequences, and whether the food arrived."""
    deaths = {}
    with tempfile.TemporaryDirectory() as folder, localized_robot(Path(folder)) as observer:
        observer.order("table_1")
        wait_for(lambda: observer.delivery_is("driving", "table_1"))
        for process in PROCESSES:
            fault = ProcessFault(observer, process)
            deaths[process] = Death(fault.stopped_ms, fault.wait_until_back())
        wait_for(lambda: observer.delivery_is("waiting", "table_1"))
        arrived = observer.distance_to("table_1") < ARRIVED_M
        observer.chefbot.stop()
    return deaths, arrived


def launch_deaths(times: int) -> list[Death]:
    """Kill a supervised launch's own process again and again."""
    deaths = []
    with run_chefbot("launch", "--supervised", str(HERE / "two_processes.yaml")) as (parent, node):

        def on_the_wire() -> bool:
            return {"odometry", "robot_state_publisher"} <= {found.name for found in node.wire.graph.nodes()}

        for _ in range(times):
            wait_for(on_the_wire)
            os.kill(children_of(parent.process.pid)[0], signal.SIGKILL)
            took = wait_for(lambda: not on_the_wire())
            deaths.append(Death(0.0, took + wait_for(on_the_wire)))
        parent.stop()
    return deaths


def show_deaths(process: str, deaths: list[Death]) -> bool:
    """Print a row; return whether the limits are met in 99 % of the kills."""
    stopped, back = (np.array(values) for values in zip(*deaths, strict=True))
    cells = "   ".join(
        " ".join(f"{value:7.{digits}f}" for value in (*np.percentile(values, (50, 99)), values.max()))
        for values, digits in ((stopped, 0), (back, 1))
    )
    print(f"{process:12} {cells}   {len(deaths):4}", flush=True)
    return bool(np.percentile(stopped, 99) <= STOP_MS and np.percentile(back, 99) <= BACK_S)


def start_and_stop() -> tuple[float, int]:
    """Return the seconds that a launch with a worker takes to end after Ctrl-C, and the processes left behind."""
    with run_launch_file("two_processes.yaml") as (one, node):
        wait_for(lambda: "robot_state_publisher" in {found.name for found in node.wire.graph.nodes()})
        children = children_of(one.process.pid)
        began = time.monotonic()
        one.stop()
        return time.monotonic() - began, sum(map(is_alive, children))


def main() -> None:
    """Print both; exit code 1 if a limit is not kept, food is lost or a process is left behind."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {times} kills of each process")
    print(f"limits: stopped p99 {STOP_MS:.0f} ms, back p99 {BACK_S:.0f} s")
    print("killed       stopped ms                back after s             kills")
    print("                p50     p99   worst       p50     p99   worst")
    rounds = [deaths_on_a_delivery() for _ in range(times)]
    kept = [show_deaths(name, [deaths[name] for deaths, _ in rounds]) for name in PROCESSES]
    kept.append(show_deaths("launch", launch_deaths(times)))
    arrived = sum(arrived for _, arrived in rounds)
    print(f"food that arrived: {arrived} of {times}")
    shut, left = zip(*(start_and_stop() for _ in range(times)), strict=True)
    print(
        f"ending a launch: {np.median(shut):.2f} s, worst {max(shut):.2f} s; processes left behind: {sum(left)}"
    )
    if not all(kept) or arrived < times or np.median(shut) > SHUT_S or any(left):
        raise SystemExit("a limit is not kept")


if __name__ == "__main__":
    main()
