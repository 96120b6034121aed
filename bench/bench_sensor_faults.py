"""Impact speed and stopping time when a sensor stops or freezes at full speed and a box is ahead.

In the simulated hotel, the robot drives straight from places chosen by the seed, the fault begins at full speed, and
0.5 s later a box appears 0.75 m ahead of it, in the middle or 0.33 m to the side.

Run: python bench/bench_sensor_faults.py [PLACES] [SEED]
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.sensor_fault_drive import (  # noqa: E402
    CONTACT,
    ROBOTS,
    TITLES,
    box_offset,
    drive_with_fault,
    sensors_of,
    straight_free_starts,
)

FAULTS = ("stop", "freeze")


def main() -> None:
    """Print a line for each robot, sensor and fault."""
    places, seed = (int(one) for one in [*sys.argv[1:], *("20", "1")[len(sys.argv) - 1 :]])
    starts = straight_free_starts("hotel", places, seed)
    print(
        f"{'robot':14}{'sensor':8}{'fault':8}{'hits':>6}{'fastest, m/s':>14}{'stands after, s':>17}{'named':>8}"
    )
    for name, robot in ROBOTS.items():
        for sensor in sensors_of(robot):
            for fault in FAULTS:
                runs = [
                    drive_with_fault(robot, start, fault, sensor, box_offset(place), seed + place)
                    for place, start in enumerate(starts)
                ]
                hits = sum(run.contact > CONTACT for run in runs)
                named = sum(TITLES[sensor] in run.description for run in runs)
                worst, late = max(run.contact for run in runs), max(run.stood_after for run in runs)
                counted = f"{hits:>3}/{places}{worst:>14.3f}{late:>17.2f}{named:>5}/{places}"
                print(f"{name:14}{sensor:8}{fault:8}{counted}", flush=True)


if __name__ == "__main__":
    main()
