"""Effect of the death of a worker process on a delivery, and start and stop of processes, at real time.

A lidar robot in a small simulated room, with the processes of `chefbot demo --processes`, drives to a table;
then each process in turn gets a `kill -9`. `stopped` is the robot's time from its last command before the kill to
the first stop command, `back` the wall time until every node of the process is on the wire again.

Run: python bench/bench_processes.py [TIMES]
"""

from __future__ import annotations

import os
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
from tests.chaos.launch_process import run_launch_file, wait_for  # noqa: E402
from tests.support.processes import children_of, is_alive  # noqa: E402

ARRIVED_M = 0.35
STOP_MS, BACK_S, SHUT_S = 200.0, 5.0, 3.0


class Death(NamedTuple):
    """The consequences of one kill."""

    stopped_ms: float
    back_s: float
    arrived: bool
    """Whether the food arrived at its table."""


def death_of(process: str) -> Death:
    """Measure one kill on the way to a table."""
    with tempfile.TemporaryDirectory() as folder, localized_robot(Path(folder)) as observer:
        observer.order("table_1")
        wait_for(lambda: observer.delivery_is("driving", "table_1"))
        fault = ProcessFault(observer, process)
        back = fault.wait_until_back()
        wait_for(lambda: observer.delivery_is("waiting", "table_1"))
        arrived = observer.distance_to("table_1") < ARRIVED_M
        observer.chefbot.stop()
        return Death(fault.stopped_ms, back, arrived)


def show_deaths(process: str, times: int) -> bool:
    """Print a row; return whether all limits were met."""
    deaths = [death_of(process) for _ in range(times)]
    stopped, back, arrived = map(np.array, zip(*deaths, strict=True))
    cells = f"{np.median(stopped):6.0f} {stopped.max():6.0f}   {np.median(back):6.1f} {back.max():6.1f}"
    print(f"{process:12} {cells}   {arrived.sum():3} of {times}", flush=True)
    return bool(np.median(stopped) <= STOP_MS and np.median(back) <= BACK_S and arrived.all())


def start_and_stop() -> tuple[float, int]:
    """Return the seconds that a launch with a worker takes to end after Ctrl-C, and the processes left behind."""
    with run_launch_file("two_processes.yaml") as (one, node):
        wait_for(lambda: "frames" in {found.name for found in node.wire.graph.nodes()})
        children = children_of(one.process.pid)
        began = time.monotonic()
        one.stop()
        return time.monotonic() - began, sum(map(is_alive, children))


def main() -> None:
    """Print both; exit code 1 if a limit is not kept in the median, food is lost or a process is left behind."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores; {times} kills of each process")
    print(f"limits       {STOP_MS:6.0f} ms         {BACK_S:6.1f} s")
    print("killed       stopped ms      back after s    food arrives")
    print("             median  worst   median  worst")
    kept = [show_deaths(process, times) for process in PROCESSES]
    shut, left = zip(*(start_and_stop() for _ in range(times)), strict=True)
    print(
        f"ending a launch: {np.median(shut):.2f} s, worst {max(shut):.2f} s; processes left behind: {sum(left)}"
    )
    if not all(kept) or np.median(shut) > SHUT_S or any(left):
        raise SystemExit("a limit is not kept")


if __name__ == "__main__":
    main()
