"""The estimated error of maps against their real one: maps of simulated drives through generated buildings.

Run: python bench/bench_map_error.py [--seeds 1,3,5] [--length 220]. Even seeds are for choosing parameters.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr
from simulated_drives import KINDS, SimulatedDrive, drifted, simulated_drive

from chefbot.maths.se2 import SE2
from chefbot.slam import GmappingParams, GraphSlamParams, SlamResult, run_log
from chefbot.slam.map_error import MapErrorEstimate, estimate_map_error

ODOMETRY_ERRORS = (0.5, 2.0, 5.0, 12.0)
"""Of the drives: from good to awful."""
MAPPERS = {
    "particle": GmappingParams(particles=1),
    "particles 8": GmappingParams(particles=8),
    "particles 30": GmappingParams(),
    "adjusted": GmappingParams(),
    "graph": GraphSlamParams(),
}
"""The poses of the particle filter as it leaves them, and "adjusted" as they are in a saved map."""
BENT = 4
"""Number of maps of each drive whose poses are true ones with a random drift, from 0.01 to 1 of bad odometry."""


class Judged(NamedTuple):
    """A map with its real error, root mean square and largest, m, and the estimate."""

    kind: str
    seed: int
    mapper: str
    rmse: float
    largest: float
    estimate: MapErrorEstimate


def judged(kind: str, seed: int, drive: SimulatedDrive) -> Iterator[Judged]:
    """Map a drive with each mapper, and with bent trajectories, and compare."""
    result: SlamResult | None = None
    for name, params in MAPPERS.items():
        result = run_log(drive.scans, params, adjusts=name == "adjusted")
        yield judge(kind, seed, name, drive, result, result.poses)
    assert result is not None
    rng = np.random.default_rng([seed, 5])
    for _ in range(BENT):
        factor = float(np.exp(rng.uniform(np.log(0.01), 0.0)))
        yield judge(kind, seed, f"bent {factor:.2f}", drive, result, bent(drive, result, factor, rng))


def bent(drive: SimulatedDrive, result: SlamResult, factor: float, rng: np.random.Generator) -> list[SE2]:
    """Return the true poses of the used scans with the drift of odometry."""
    poses = drifted(drive.truth, factor, rng)
    return [poses[i] for i in used(drive, result)]


def used(drive: SimulatedDrive, result: SlamResult) -> list[int]:
    """Return the indices of the scans in the map."""
    stamps = np.array([scan.stamp for scan in drive.scans])
    return [int(i) for i in np.searchsorted(stamps, np.array(result.stamps) - 1e-9)]


def judge(
    kind: str, seed: int, name: str, drive: SimulatedDrive, result: SlamResult, poses: list[SE2]
) -> Judged:
    """Compare the poses with the truth, and estimate their error without it."""
    truth = [drive.truth[i] for i in used(drive, result)]
    a, b = (np.array([pose.x + 1j * pose.y for pose in path]) for path in (poses, truth))
    turn = np.vdot(a - a.mean(), b - b.mean())
    errors = np.abs((a - a.mean()) * turn / abs(turn) - (b - b.mean()))
    estimate = estimate_map_error(result.sessions, poses, result.range_offset)
    return Judged(kind, seed, name, float(np.sqrt(np.mean(errors**2))), float(errors.max()), estimate)


def correlation(rows: list[Judged]) -> str:
    """Return the rank correlation of the estimate with the real error, and how far the estimate is off."""
    real, estimated = np.array([r.rmse for r in rows]), np.array([r.estimate.error for r in rows])
    parts = [spearmanr([r.estimate.drift for r in rows], real)[0]]
    parts.append(spearmanr([r.estimate.contradiction for r in rows], real)[0])
    ratio = np.percentile(estimated / real, (10, 50, 90))
    return (
        f"{spearmanr(estimated, real)[0]:.2f} (drift alone {parts[0]:.2f}, contradiction alone {parts[1]:.2f}); "
        f"estimate / real error {ratio[0]:.1f}, {ratio[1]:.1f}, {ratio[2]:.1f} (10th, 50th, 90th percentile)"
    )


def main() -> None:
    """Print a row a map, and the rank correlations."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1,3,5")
    parser.add_argument("--length", type=float, default=220.0)
    arguments = parser.parse_args()
    rows: list[Judged] = []
    for seed in map(int, arguments.seeds.split(",")):
        for k, kind in enumerate(KINDS):
            error = ODOMETRY_ERRORS[(seed // 2 + k) % len(ODOMETRY_ERRORS)]
            for row in judged(kind, seed, simulated_drive(kind, seed, error, arguments.length)):
                rows.append(row)
                print(
                    f"{kind:10} {seed:3} {row.mapper:13} real {row.rmse:7.3f} m, largest {row.largest:7.3f}; "
                    f"estimate {row.estimate.error:7.3f} (drift {row.estimate.drift:.3f}, contradiction "
                    f"{row.estimate.contradiction:.3f}), seen again {row.estimate.compared:.0%}",
                    flush=True,
                )
    mapped = [row for row in rows if not row.mapper.startswith("bent")]
    print(f"all {len(rows)}: {correlation(rows)}")
    print(f"mapped {len(mapped)}: {correlation(mapped)}")
    for name in list(MAPPERS)[1:]:
        chosen = [row for row in rows if row.mapper == name]
        print(f"{name} {len(chosen)}: {correlation(chosen)}")


if __name__ == "__main__":
    main()
