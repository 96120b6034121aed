"""Memory and CPU time of a built robot's programs: launches on emulated hardware, whose bytes pass the real drivers.

Each launch runs in processes of its own beside the emulated hardware, which a real robot does not have. `resident`
is the memory of its first process and what the others do not share with anybody, in MB (proc(5), smaps_rollup): at
the end, and the maximum. `cpu` is the CPU time of them all in the second half of the time, in percent of one core.

Run: python bench/bench_memory.py [SECONDS [ROBOT [LAUNCH...]]]
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.processes import children_of  # noqa: E402

from chefbot.demo.summary import ground_truth_map  # noqa: E402
from chefbot.proving.built_robot import BuiltSetup, HardwareProcess, RobotProcess  # noqa: E402
from chefbot.robot.load import load_robot  # noqa: E402
from chefbot.sim.world.load import load_any_world  # noqa: E402
from chefbot.storage.map_files import save_map  # noqa: E402

LAUNCHES = ("gmapping_demo", "explore", "explore mapper:=graph", "amcl_demo", "waiter")
WORLD = "hotel"


class Usage(NamedTuple):
    """Resident memory at the end and its maximum, MB, and CPU time in percent of one core."""

    last: float
    maximum: float
    cpu: float


def processes_of(pid: int) -> list[int]:
    """Return a process and all those that it has started, directly or not."""
    return [pid, *(one for child in children_of(pid) for one in processes_of(child))]


def resident(pid: int, *fields: str) -> float:
    """Return the sum of fields of a process's smaps_rollup, MB; 0 if it has ended."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    sizes = dict(re.findall(r"^(\w+):\s+(\d+)", text, re.MULTILINE))
    return sum(int(sizes[field]) for field in fields) / 1024


def memory(pid: int) -> float:
    """Return the resident memory of a process, and what those that it has started have for themselves, MB."""
    _, *others = processes_of(pid)
    return resident(pid, "Rss") + sum(resident(one, "Private_Clean", "Private_Dirty") for one in others)


def cpu_time(pid: int) -> float:
    """Return the CPU time of a process and all that it has started, s."""
    total = 0
    for one in processes_of(pid):
        try:
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue
        total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


def watch(pid: int, seconds: float) -> list[float]:
    """Return the memory of a launch twice a second, MB."""
    samples, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(0.5)
        samples.append(memory(pid))
    return samples


def measure(setup: BuiltSetup, launch: str, seconds: float) -> Usage:
    """Run a launch on emulated hardware for some seconds, and return what it takes."""
    hardware = HardwareProcess(setup)
    try:
        hardware.wait(lambda: bool(hardware.states), "the hardware did not start", 90.0)
        name, *given = launch.split()
        if name in ("amcl_demo", "waiter"):
            given.append(f"map_file:={setup.folder / 'map.yaml'}")
        with closing(RobotProcess(setup, hardware, name, *given)) as robot:
            samples = watch(robot.pid, seconds / 2)
            began, before = time.monotonic(), cpu_time(robot.pid)
            samples += watch(robot.pid, seconds / 2)
            cpu = 100.0 * (cpu_time(robot.pid) - before) / (time.monotonic() - began)
            return Usage(float(np.median(samples[-10:])), max(samples), cpu)
    finally:
        hardware.close()


def main(seconds: float, robot: str, launches: list[str]) -> None:
    spec = load_robot(robot)
    truth = ground_truth_map(load_any_world(WORLD, spec), spec)
    print(f"{robot} in {WORLD}, {seconds:.0f} s each; MB, % of a core")
    print("launch                      resident  maximum  cpu")
    for launch in launches:
        with tempfile.TemporaryDirectory() as folder:
            save_map(Path(folder) / "map", truth)
            found = measure(BuiltSetup(robot, WORLD, "real", 1, Path(folder)), launch, seconds)
        print(f"{launch:27} {found.last:8.0f} {found.maximum:8.0f} {found.cpu:4.0f}", flush=True)


if __name__ == "__main__":
    arguments = sys.argv[1:]
    main(
        float(arguments[0]) if arguments else 60.0,
        arguments[1] if len(arguments) > 1 else "chefbot_lidar",
        arguments[2:] or list(LAUNCHES),
    )
