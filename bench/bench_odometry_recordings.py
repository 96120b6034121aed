"""The filter on robot_localization's own two recordings: error of the end pose beside its tolerance."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import numpy as np

from chefbot.odometry.ekf import Ekf

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "odometry"))
from robot_localization_bags import BODY, load

ROOT = Path(__file__).resolve().parents[1]
FOLDER = Path(os.environ.get("CHEFBOT_SHARED", ROOT.parent / "shared")) / "data" / "ekf"


def main() -> None:
    """Print the table; exit code 1 if an error exceeds half of the tolerance."""
    if not FOLDER.exists():
        print(
            f"The recordings are not there: {FOLDER}; set CHEFBOT_SHARED to the folder that holds data/ekf."
        )
        return
    print("bag   readings error, m   half the tolerance, m us per reading   rejected")
    missed = False
    for number in (1, 2):
        recording, ekf = load(FOLDER, number), Ekf(BODY)
        begun = time.perf_counter()
        for reading in recording.readings:
            ekf.add(reading)
        micros = 1e6 * (time.perf_counter() - begun) / len(recording.readings)
        off = float(np.linalg.norm(ekf.belief.state[:3] - recording.end))
        refused = ", ".join(f"{s.value} {w.refused}" for s, w in ekf.belief.monitors.items() if w.refused)
        half = recording.tolerance / 2
        print(f"{number:3d} {len(recording.readings):10d} {off:8.4f} {half:23.4f} {micros:14.0f}   {refused}")
        missed |= off > half
    if missed:
        raise SystemExit("beyond half of the tolerance")


if __name__ == "__main__":
    main()
