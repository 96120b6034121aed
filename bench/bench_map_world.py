"""Maps of a cluttered building as worlds: load time, memory, solids, and the time of a step and of a laser scan.

Run: python bench/bench_map_world.py [CELLS ...], cells a side; without numbers 500, 1000, 2000 and 4000.

Each size is loaded in a process of its own. Times are CPU seconds; memory is the largest that the process has held
(ru_maxrss), of which `imports` were there before the map was read. `whole` is the time of a step and of a scan if
all solids were in the model, for comparison.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from chefbot.maths.grid import FREE, OCCUPIED, UNKNOWN, Grid
from chefbot.robot.load import load_robot
from chefbot.sim import nearby_solids
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.load import load_any_world, with_drawn_places
from chefbot.storage.map_files import save_map

SIZES = (500, 1000, 2000, 4000)
ROOM = 120
"""Side of a room, cells of 5 cm."""
CLUTTER = 0.004
"""Share of the cells in which a block of clutter begins."""
WHOLE_UP_TO = 30_000
"""Number of solids up to which all are simulated for comparison; MuJoCo's compiler takes quadratic time."""


def cluttered_building(size: int) -> Grid:
    """Return rooms with doors, clutter everywhere and ragged unknown space outside, 5 cm a cell."""
    rng = np.random.default_rng(size + 1)
    cells = np.full((size, size), FREE, np.int8)
    for wall in range(ROOM // 2, size, ROOM):
        cells[wall : wall + 2], cells[:, wall : wall + 2] = OCCUPIED, OCCUPIED
        for door in range(0, size, ROOM):
            cells[wall : wall + 2, door : door + 20], cells[door : door + 20, wall : wall + 2] = FREE, FREE
    for row, column in rng.integers(0, size, (round(CLUTTER * size * size / 4), 2)):
        height, width = rng.integers(1, 6, 2)
        cells[row : row + height, column : column + width] = OCCUPIED
    margins = rng.integers(size // 40, size // 20, (2, size))
    for i in range(size):
        cells[i, : margins[0, i]], cells[: margins[1, i], i] = UNKNOWN, UNKNOWN
    return Grid(cells, 0.05, -size * 0.02, 3.0)


def time_of(work: Callable[[], object], repeats: int) -> float:
    """Return CPU seconds of one call, the mean of `repeats`."""
    begun = time.process_time()
    for _ in range(repeats):
        work()
    return (time.process_time() - begun) / repeats


def memory_mb() -> float:
    """Return the largest memory that this process has held, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure(path: Path) -> None:
    """Load a map as a world, simulate in it, and print a line of figures."""
    robot, imports = load_robot("chefbot_lidar"), memory_mb()
    begun = time.process_time()
    world = load_any_world(str(path), robot)
    loaded = time.process_time() - begun
    places = with_drawn_places(world, robot, 1).places
    drawn = time.process_time() - begun
    sim = Simulation(robot, world, "real", 1)
    ready, memory = time.process_time() - begun, memory_mb()
    sim.set_duty(0.3, 0.3)
    step, scan = time_of(sim.step, 400), time_of(sim.lidar, 40)
    whole = ""
    if len(world.static) <= WHOLE_UP_TO:
        nearby_solids.MAX_UNFILTERED_SOLIDS = WHOLE_UP_TO
        all_of_it = Simulation(robot, world, "real", 1)
        whole = f"{1e3 * time_of(all_of_it.step, 200):8.2f}{1e3 * time_of(all_of_it.lidar, 20):8.2f}"
    print(
        f"{path.stem:>6}{len(world.static):9}{len(sim._nearby.touchable):8}{len(places):8}{loaded:8.2f}{drawn:8.2f}"
        f"{ready:8.2f}{imports:9.0f}{memory:9.0f}{1e3 * step:8.3f}{1e3 * scan:8.2f}{whole}"
    )


def main() -> None:
    """Measure each size in a process of its own."""
    if len(sys.argv) == 2 and sys.argv[1].endswith(".yaml"):
        measure(Path(sys.argv[1]))
        return
    print(f"{'':44}CPU s{'':12}memory, MB{'':8}ms{'':10}ms, whole")
    print(
        f"{'cells':>6}{'solids':>9}{'nearby':>8}{'places':>8}{'load':>8}{'places':>8}{'ready':>8}{'imports':>9}{'all':>9}"
        f"{'step':>8}{'scan':>8}{'step':>8}{'scan':>8}",
        flush=True,
    )
    with tempfile.TemporaryDirectory() as folder:
        for size in [int(text) for text in sys.argv[1:]] or SIZES:
            path = save_map(Path(folder) / str(size), cluttered_building(size))
            subprocess.run([sys.executable, __file__, str(path)], check=True)


if __name__ == "__main__":
    main()
