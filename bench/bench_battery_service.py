"""Orders that the battery strands in days of service: the real battery monitor and round on a modelled, ageing pack.

Robots, houses, packs, mornings and lies of the gauge are drawn by the seed, see tests/support/battery_service.py.
Even seeds were used for choosing parameters, odd ones are for judging.

Run: python bench/bench_battery_service.py [--days 100] [--seeds 1,3,5] [--robot chefbot] [--unwatched]
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.support.battery_service import Service


def main() -> None:
    """Print a line for each seed and the sum."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--days", type=int, default=100)
    parser.add_argument("--seeds", default="1,3,5,7,9")
    parser.add_argument("--robot", default="chefbot")
    parser.add_argument("--unwatched", action="store_true", help="without the battery monitor")
    parser.add_argument("--notes", action="store_true", help="print each robot that stopped")
    given = parser.parse_args()
    total: Counter[str] = Counter()
    for seed in map(int, given.seeds.split(",")):
        cpu = process_time()
        service = Service(seed, given.robot, is_watched=not given.unwatched)
        counts = service.run(given.days)
        total += counts
        print(f"seed {seed}: {dict(sorted(counts.items()))} ({process_time() - cpu:.0f} s CPU)", flush=True)
        for note in service.notes if given.notes else ():
            print("   ", note)
    print("all:", dict(sorted(total.items())))


if __name__ == "__main__":
    main()
