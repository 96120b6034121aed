"""Both mapping algorithms on all recordings: error, CPU time and memory; each run in a process of its own."""

from __future__ import annotations

import argparse
import gzip
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.slam import GmappingParams, GraphSlamParams, SlamResult, run_log
from chefbot.slam.carmen import parse
from chefbot.slam.recorded_scan import RecordedOdometry, RecordedScan
from chefbot.slam.relations import parse_relations, relation_errors, track_of_log
from chefbot.storage.map_files import map_png

SHARED = Path(os.environ.get("CHEFBOT_SHARED", Path(__file__).parents[2] / "shared")) / "data" / "slam"
TUNED = ("intel_full", "csail", "simul", "fr101", "seattle", "edmonton")
JUDGED = ("acapulco", "fhw", "fr_campus")
SEATTLE_FIRST = 40
"""Scan of seattle from which its reference is right."""
PEERS = {
    "intel_full": "0.064 (0.036)", "csail": "0.104", "simul": "0.055", "fr101": "0.052-0.057", "seattle": "0.102",
    "edmonton": "0.26-0.63", "acapulco": "0.16-0.38", "fhw": "0.23-0.62", "fr_campus": "1.08",
}  # fmt: skip
"""C++ GMapping, 30 particles, on the same files: m."""
RESULTS = Path(__file__).parent / "results" / "slam.md"
PICTURES = Path("runs/bench_slam")


def records_of(name: str) -> list[RecordedOdometry | RecordedScan]:
    """Return the readings of a recording."""
    if name != "simul":
        return list(parse(gzip.decompress((SHARED / f"{name}.log.gz").read_bytes()).decode()))
    z = np.load(SHARED / "simul.npz")
    angles = (z["angle_min"] + np.arange(z["ranges"].shape[1]) * z["angle_increment"]).astype(np.float32)
    ranges = np.where(z["valid"].astype(bool), z["ranges"], np.inf).astype(np.float32)
    mount = SE2.of(z["sensor_pose"])
    odoms = [SE2.of(o) for o in z["odom"]]
    return [
        RecordedScan(float(t), angles, r, o @ mount, o) for t, r, o in zip(z["t"], ranges, odoms, strict=True)
    ]


def reference_of(name: str) -> np.ndarray:
    """Return rows (t, x, y): the truth of simul, else the poses of the reference mapper."""
    if name == "simul":
        z = np.load(SHARED / "simul.npz")
        return np.column_stack([z["t"], z["truth"][:, :2]])
    plain = {"intel_full": "intel_reference.tum", "csail": "csail_reference.tum"}
    return np.loadtxt(SHARED / plain.get(name, f"{name}_reference.tum.gz"))[:, :3]


def ate(stamps: np.ndarray, found: np.ndarray, reference: np.ndarray) -> float:
    """Return the root mean square position error after alignment (Umeyama 1991), m."""
    near = np.abs(reference[:, 0] - stamps[:, None]).argmin(axis=1)
    paired = np.abs(reference[near, 0] - stamps) < 0.05
    a, b = found[paired], reference[near[paired], 1:]
    za, zb = ((p - p.mean(axis=0)) @ [1.0, 1.0j] for p in (a, b))
    turn = np.vdot(za, zb)
    return float(np.sqrt(np.mean(np.abs(za * turn / abs(turn) - zb) ** 2)))


def errors_of(
    name: str, records: list[RecordedOdometry | RecordedScan], result: SlamResult
) -> dict[str, float]:
    """Return the errors of a trajectory, m."""
    stamps, poses = np.array(result.stamps), np.array(result.poses)[:, :2]
    if name == "seattle":
        scans = [r for r in records if isinstance(r, RecordedScan)]
        later = stamps >= scans[SEATTLE_FIRST].stamp
        stamps, poses = stamps[later], poses[later]
    errors = {"ate": ate(stamps, poses, reference_of(name))}
    if name == "intel_full":
        track = track_of_log(records, result.stamps, result.poses)
        for key, file in (("relations", "intel.relations"), ("exact", "intel_exact.relations")):
            errors[key] = float(relation_errors(track, parse_relations((SHARED / file).read_text())).mean())
    return errors


def measure(name: str, algorithm: str, seed: int) -> dict[str, float]:
    """Map a recording in this process and return errors, CPU seconds and memory."""
    records = records_of(name)
    max_cells = 400_000_000
    params: GmappingParams | GraphSlamParams = GraphSlamParams(max_cells=max_cells)
    if algorithm == "gmapping":
        params = GmappingParams(seed=seed, max_cells=max_cells)
    first = [r for r in records if isinstance(r, RecordedScan)][:60]
    run_log(first, params)  # compiles
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin = time.process_time()
    result = run_log(records, params)
    figures = {"cpu": time.process_time() - begin}
    figures["memory"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    PICTURES.mkdir(parents=True, exist_ok=True)
    (PICTURES / f"{name}_{algorithm}_{seed}.png").write_bytes(map_png(result.grid))
    return (
        figures
        | errors_of(name, records, result)
        | {"closures": len(result.closures), "offset": result.range_offset}
    )


def measured_apart(name: str, algorithm: str, seed: int) -> dict[str, float]:
    """Run `measure` in a process of its own: memory is that of one run."""
    command = [sys.executable, __file__, "--only", name, algorithm, str(seed)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    print(name, algorithm, seed, {k: round(v, 4) for k, v in figures.items()}, flush=True)
    return figures


def row(name: str, seeds: int) -> str:
    """Return the row of a recording."""
    graph = measured_apart(name, "graph", 1)
    filtered = [measured_apart(name, "gmapping", seed) for seed in range(1, seeds + 1)]
    key = "relations" if name == "intel_full" else "ate"
    value = f"{graph[key]:.3f}" + (f" ({graph['exact']:.3f})" if "exact" in graph else "")
    particles = " ".join(f"{f[key]:.3f}" + (f" ({f['exact']:.3f})" if "exact" in f else "") for f in filtered)
    costs = (
        f"{graph['cpu']:.1f} | {graph['memory']:.0f} | {filtered[0]['cpu']:.1f} | {filtered[0]['memory']:.0f}"
    )
    return f"| {name} | {value} | {particles} | {PEERS[name]} | {costs} | {1e3 * graph['offset']:+.0f} |"


def main(seeds: int) -> None:
    """Measure all recordings and write the table."""
    head = "| log | graph | particles | C++ GMapping | graph CPU s | MB | particles CPU s | MB | range offset mm |\n"
    lines = [
        "# Mapping of recordings\n",
        "Written by `make bench-slam`. Errors in m: on intel_full the mean of all relations, in brackets of those\n"
        "between two scans; elsewhere the ATE to the truth (simul) or to the reference of the data set, which is a\n"
        "mapper's own and good to some decimetres in large loops. seattle from its 41st scan. MB: peak beyond that\n"
        "of a short run. C++ GMapping: 30 particles, the same files, another run.\n",
    ]
    for title, names in (("Parameters were chosen on these", TUNED), ("Judged on these", JUDGED)):
        table = "\n".join(row(name, seeds) for name in names)
        lines.append(f"## {title}\n\n{head}|{'---|' * 9}\n{table}\n")
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text("\n".join(lines))
    print(RESULTS.read_text())


if __name__ == "__main__":
    cli = argparse.ArgumentParser(description=__doc__)
    cli.add_argument("--seeds", type=int, default=1, help="seeds of the particle filter")
    cli.add_argument("--only", nargs=3, help="name, algorithm, seed: print one measurement as JSON")
    arguments = cli.parse_args()
    if arguments.only:
        print(json.dumps(measure(arguments.only[0], arguments.only[1], int(arguments.only[2]))))
    else:
        main(arguments.seeds)
