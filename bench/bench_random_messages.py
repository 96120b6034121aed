"""Random legal messages on all inputs of all launches: exits, signals, and the CPU time of each callback.

COUNT messages are divided among the built-in launches, three robots and processes of at most PER_RUN messages, each
with a seed of its own. Results are appended to FILE, one line of JSON for each process, and what is in FILE
already is not run again. So ten million messages, which take hours, can be published in parts, on several computers:

    python bench/bench_random_messages.py --count 10000000 --minutes 60 --out runs/random_messages.jsonl

Run: python bench/bench_random_messages.py [--count COUNT] [--minutes MINUTES] [--part I/N] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.launch_process import free_port  # noqa: E402
from tests.chaos.random_messages import LIMIT_MS, MAIN_LAUNCHES  # noqa: E402

from chefbot.robot.load import load_robot  # noqa: E402
from chefbot.runtime.launch import built_in_launches  # noqa: E402
from chefbot.sim.world.floor_plan import floor_plan  # noqa: E402
from chefbot.sim.world.load import load_any_world  # noqa: E402
from chefbot.storage.map_files import save_map  # noqa: E402
from chefbot.storage.places import places_path, save_places  # noqa: E402

PER_RUN = 20_000
ROBOTS = ("chefbot_lidar", "chefbot", "jackal")
MAIN_WEIGHT = 8
"""Weight of the launches that contain all nodes, against 1 of each other launch."""


class Run(NamedTuple):
    """The messages of one process."""

    launch: str
    robot: str
    seed: int
    count: int

    @property
    def name(self) -> str:
        """Name in the results."""
        return f"{self.launch} {self.robot} {self.seed} {self.count}"


def runs(count: int) -> Iterator[Run]:
    """Yield the runs of `count` messages, one of each launch and robot after the other; seeds are odd."""
    weights = {launch: MAIN_WEIGHT if launch in MAIN_LAUNCHES else 1 for launch in built_in_launches()}
    unit = count / sum(weights.values()) / len(ROBOTS)
    parts = max(1, math.ceil(unit * MAIN_WEIGHT / PER_RUN))
    for part in range(parts):
        for launch, weight in weights.items():
            for robot in ROBOTS:
                yield Run(launch, robot, 2 * part + 101, math.ceil(unit * weight / parts))


def execute(run: Run, room: Path) -> dict[str, Any]:
    """Execute a run and return its result; without one, the exit code and the end of its output."""
    command = [
        sys.executable,
        "-m",
        "tests.chaos.random_messages",
        "--launch",
        run.launch,
        "--robot",
        run.robot,
    ]
    command += ["--count", str(run.count), "--seed", str(run.seed), "--map", str(room)]
    command += ["--port", str(free_port()), "--cpu", str(600 + run.count)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode == 0:
        return {"run": run.name, "code": 0, **json.loads(done.stdout.splitlines()[-1])}
    return {
        "run": run.name,
        "code": done.returncode,
        "generated": 0,
        "accepted": 0,
        "end": done.stderr[-4000:],
    }


def show(results: list[dict[str, Any]]) -> bool:
    """Print the totals; return whether no process ended early and no callback was slow."""
    ended = [result for result in results if result["code"] != 0]
    signals = [result for result in ended if result["code"] < 0]
    slow = [(result["run"], result["slow"]) for result in results if result.get("slow")]
    worst = max((worst for result in results for worst in result.get("worst_ms", {}).values()), default=0.0)
    bugs = sum(result.get("unexpected", 0) for result in results)
    generated, accepted = (sum(result[key] for result in results) for key in ("generated", "accepted"))
    print(f"{accepted} legal messages published, of {generated} generated, in {len(results)} processes")
    print(f"exits {len(ended) - len(signals)}, signals {len(signals)}, exceptions by bugs {bugs}")
    print(f"callbacks over {LIMIT_MS:g} ms of CPU time: {len(slow)}; worst {worst:.1f} ms")
    for name, result in [*((one["run"], one["end"]) for one in ended), *slow]:
        print(f"  {name}: {result}")
    return not (ended or slow or bugs)


def save_room(folder: Path) -> Path:
    """Save map and places of the room, and return the map's path."""
    path, robot = folder / "room.yaml", load_robot("chefbot_lidar")
    world = load_any_world("room", robot)
    save_map(path, floor_plan(world, robot.sensors.lidar.mount.z))
    save_places(places_path(path), world.places)
    return path


def main() -> None:
    """Execute what is not in the file yet, and print the totals of the file; exit code 1 if a limit is not kept."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100_000, help="messages of all parts together")
    parser.add_argument("--minutes", type=float, default=math.inf, help="start no process after this time")
    parser.add_argument("--part", default="1/1", help="I/N: every N-th process, beginning with the I-th")
    parser.add_argument(
        "--out", type=Path, default=Path("runs/random_messages.jsonl"), help="file of results"
    )
    options = parser.parse_args()
    first, _, step = options.part.partition("/")
    begun = time.monotonic()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    lines = options.out.read_text().splitlines() if options.out.exists() else []
    done = {json.loads(line)["run"] for line in lines}
    with tempfile.TemporaryDirectory() as folder:
        room = save_room(Path(folder))
        for run in list(runs(options.count))[int(first) - 1 :: int(step)]:
            if time.monotonic() - begun > 60.0 * options.minutes:
                break
            if run.name not in done:
                with options.out.open("a") as file:
                    file.write(json.dumps(execute(run, room)) + "\n")
    if not show([json.loads(line) for line in options.out.read_text().splitlines()]):
        raise SystemExit("a limit is not kept")


if __name__ == "__main__":
    main()
