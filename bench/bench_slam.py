"""Mapping by particle filter: the complete Intel log, the matcher's score, time by number of particles.

`make bench-slam` then measures both algorithms on all recordings (slam_logs.py).

    python bench/bench_slam.py [FOLDER_WITH_THE_RECORDINGS]

C++ figures: GMapping of ros-perception, -O2, two cores of an Intel Xeon, on the same log (at another
load: compare orders of magnitude). One core is used; all times, including those of C++, are CPU times.
"""

from __future__ import annotations

import gzip
import os
import sys
import time
from pathlib import Path

import numpy as np
from numba import njit

from chefbot.slam import Gmapping, GmappingParams
from chefbot.slam.carmen import parse
from chefbot.slam.matching import score
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.scan_beams import beams_of

CPP_TOTAL_S, CPP_PER_SCAN_MS, CPP_NS_PER_BEAM = 48.0, 63.0, 114.0


@njit
def many_scores(points, x, y, yaw, table, mean_x, mean_y):  # type: ignore[no-untyped-def]
    """Return 27 poses around one, as for the C++ figure."""
    total = 0.0
    for k in range(27):
        dx, dy, turn = 0.3 * (k % 3 - 1), 0.3 * (k // 3 % 3 - 1), 0.01 * (k // 9 - 1)
        total += score(points, x + dx, y + dy, yaw + turn, np.float32(1), table, mean_x, mean_y)
    return total


def run(scans: list[RecordedScan], particles: int) -> tuple[Gmapping, list[RecordedScan], np.ndarray]:
    """Return the mapper after all scans, the processed scans, and their times in ms."""
    slam, used, ms = Gmapping(GmappingParams(particles=particles)), [], []
    for scan in scans:
        begin = time.process_time()
        if slam.update(scan.angles, scan.ranges, scan.odom, range_max=80.0):
            ms.append(1e3 * (time.process_time() - begin))
            used.append(scan)
    return slam, used, np.array(ms)


def beam_times(slam: Gmapping, used: list[RecordedScan]) -> np.ndarray:
    """Return the ns per beam of the score, in several rounds over all scans in the best particle's map."""
    level, best = slam._levels[1], slam._best
    args = level.maps.table[best], level.maps.mean_x, level.maps.mean_y
    poses = level._local(np.array(slam.trajectory()))
    points = [level.points(beams_of(s.angles, s.ranges, slam._sensor, 80.0, 3.0).surfaces) for s in used]
    beams, times = 27 * sum(len(p) for p in points), []
    for _ in range(6):
        begin = time.process_time()
        for p, (x, y, yaw) in zip(points, poses, strict=True):
            many_scores(p, x, y, yaw, *args)
        times.append(1e9 * (time.process_time() - begin) / beams)
    return np.array(times[1:])


def main() -> None:
    """Print the tables."""
    default = Path(os.environ.get("CHEFBOT_SHARED", Path(__file__).parents[2] / "shared")) / "data" / "slam"
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else default
    log = gzip.decompress((folder / "intel_full.log.gz").read_bytes()).decode()
    scans = [r for r in parse(log) if isinstance(r, RecordedScan)]
    run(scans[:200], 5)[0].map()  # compiles
    print(f"Intel, {len(scans)} scans of 180 beams, 2691 s; {os.cpu_count()} cores, 1 used")
    print("particles  processed  CPU s  real-time  ms/scan median    p90    max  map ms  tiles MB")
    for particles in (15, 30, 60):
        slam, used, ms = run(scans, particles)
        begin = time.process_time()
        slam.map()
        map_ms = 1e3 * (time.process_time() - begin)
        tiles = sum(v.maps.tiles_in_use * v.maps.mean_x.shape[1] * 12 for v in slam._levels) / 1e6
        total = ms.sum() / 1e3
        row = f"{np.median(ms):14.2f} {np.percentile(ms, 90):6.2f} {ms.max():6.2f} {map_ms:7.1f} {tiles:9.1f}"
        print(f"{particles:9d} {len(ms):10d} {total:7.2f} {2691 / total:11.0f} {row}")
        if particles == 30:
            beams = beam_times(slam, used)
    print(f"C++ GMapping, 30: about 800 processed, {CPP_TOTAL_S} s CPU, {CPP_PER_SCAN_MS} ms/scan")
    print(f"score(): {np.median(beams):.1f} ns/beam (min {beams.min():.1f}); C++ {CPP_NS_PER_BEAM}")


if __name__ == "__main__":
    main()
