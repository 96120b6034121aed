"""What Dask and processes cost: a run in its process alone, through Dask, and on two workers at once.

Run: python bench/bench_prove.py [--runs 6]
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.kernels.precompile import compile_kernels
from chefbot.proving.cluster import cluster
from chefbot.proving.collect import collect
from chefbot.proving.record import RunRecord
from chefbot.proving.run_spec import RunSpec, run_specs
from chefbot.proving.scenario import parse_scenario
from chefbot.proving.worker import make_run_in_process

SCENARIO = b"{name: bench, world: room, task: {type: drive_randomly, duration: 60}, criteria: {}}"
DASK_LIMIT, SPEED_UP = 0.5, 1.9
"""Wanted: at most so many seconds for Dask, at least so much from a second worker."""


def alone(specs: list[RunSpec]) -> list[float]:
    """Return the wall time of each run in a process of its own, without Dask, s."""
    times = []
    for spec in specs:
        began = time.perf_counter()
        make_run_in_process(msgspec.msgpack.encode(spec))
        times.append(time.perf_counter() - began)
    return times


def through_dask(specs: list[RunSpec], workers: int) -> tuple[float, list[RunRecord]]:
    """Return the wall time of all runs, without the start of the cluster, s, and their records."""
    records: list[RunRecord] = []
    with cluster("", workers) as connected:
        began = time.perf_counter()
        collect(connected, specs, lambda record, _: records.append(record))
        return time.perf_counter() - began, records


def main() -> None:
    """Print the three figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=6)
    given = parser.parse_args()
    compile_kernels(Console())
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    specs = run_specs(parse_scenario(SCENARIO, "bench"), Path(), list(range(1, given.runs + 1)))
    plain = alone(specs)
    one, records = through_dask(specs, 1)
    two, _ = through_dask(specs, 2)
    added = one / given.runs - statistics.mean(plain)
    simulated = sum(record.sim_time for record in records)
    outside = statistics.median(
        wall - record.wall_time
        for wall, record in zip(plain, sorted(records, key=lambda r: r.seed), strict=True)
    )
    print(
        f"a run alone: median {statistics.median(plain):.2f} s, of which {outside:.2f} s are the process's start"
    )
    print(f"Dask adds {added:.2f} s to a run (wanted: at most {DASK_LIMIT})")
    print(f"one worker: {simulated / one:.1f} simulated s per s; two: {simulated / two:.1f}")
    print(f"two workers are {one / two:.2f} times as fast as one (wanted: at least {SPEED_UP})")


if __name__ == "__main__":
    main()
