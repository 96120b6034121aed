"""Approaches of a camera robot to drop-offs of 3 cm and more: how many drive over, and where it stops.

Angles up to 60 degrees, depths from 3 cm to stairs and 50 cm, 0.4 to 1.5 times the robot's speed, along a path and by
drive_on_heading; odd seeds.

Run: python bench/bench_drop_offs.py [COUNT] [ROBOT]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.drop_off_drive import approach_edge, draw_approach  # noqa: E402


def main() -> None:
    """Print a line for each approach, and the totals."""
    count, robot = [*sys.argv[1:], *("50", "chefbot")[len(sys.argv) - 1 :]]
    arrivals = []
    for seed in range(1, 2 * int(count), 2):
        approach = draw_approach(seed)
        with tempfile.TemporaryDirectory() as folder:
            arrivals.append(approach_edge(approach, Path(folder), seed, robot))
        how = "path" if approach.by_path else "heading"
        print(
            f"{seed:4} depth {approach.depth:5.2f} yaw {approach.yaw:5.2f} {how:8}"
            f"speed {arrivals[-1].speed:5.2f} gap {arrivals[-1].gap:6.3f}{' OVER' if arrivals[-1].over else ''}",
            flush=True,
        )
    over = sum(arrival.over for arrival in arrivals)
    print(f"{robot}: {over} of {len(arrivals)} over; gap {min(a.gap for a in arrivals):.3f} m and more")


if __name__ == "__main__":
    main()
