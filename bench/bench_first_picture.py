"""Time from `chefbot demo` to the first picture, with compiled kernels and without.

A WebSocket client replaces the browser: it tries to connect from the start and records the first arrival of each
layer. The cold start begins with empty caches, as after an installation.

Run: python bench/bench_first_picture.py [--robot chefbot_lidar] [--world room]
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import websockets

PORT = 18417
PICTURE = ("robot", "map", "camera")
WANTED = (*PICTURE, "scan")
LIMIT = 300.0
SOURCE = Path(__file__).resolve().parents[1] / "src"


def layer_of(frame: str | bytes) -> str:
    """Return the layer's name: text frames are JSON; binary ones begin with the length of a JSON header."""
    if isinstance(frame, str):
        return str(json.loads(frame).get("layer", ""))
    size = int.from_bytes(frame[:2], "little")
    return str(json.loads(frame[2 : 2 + size]).get("layer", ""))


async def watch(began: float, process: subprocess.Popen[str]) -> dict[str, float]:
    """Return the seconds from `began` to the first frame of each layer, until all wanted layers have arrived."""
    seen: dict[str, float] = {}
    while not set(WANTED) <= set(seen) and time.monotonic() - began < LIMIT and process.poll() is None:
        try:
            async with websockets.connect(f"ws://127.0.0.1:{PORT}/live", max_size=None) as page:
                seen.setdefault("page", time.monotonic() - began)
                while not set(WANTED) <= set(seen):
                    frame = await asyncio.wait_for(page.recv(), LIMIT)
                    seen.setdefault(layer_of(frame), time.monotonic() - began)
        except (OSError, websockets.WebSocketException):
            await asyncio.sleep(0.05)
    return seen


def first_frames(robot: str, world: str, caches: Path) -> dict[str, float]:
    """Return the times of one start of the demo with these caches; then end the demo."""
    options = ["--robot", robot, "--world", world, "--port", str(PORT), "--out", str(caches / "run")]
    with (caches / "output.txt").open("w") as output:
        began = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, "-m", "chefbot", "demo", *options],
            env=environment(caches),
            text=True,
            stdout=output,
        )
        try:
            return asyncio.run(watch(began, process))
        finally:
            process.terminate()
            process.wait()


def row(name: str, seen: dict[str, float]) -> None:
    """Print a line of the table."""
    names = ("page", "progress", *WANTED)
    print(f"{name:8}" + "".join(f"{seen[n]:10.2f}" if n in seen else f"{'-':>10}" for n in names))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", default="chefbot")
    parser.add_argument("--world", default="hotel")
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; {given.robot} in {given.world}; seconds")
    print(f"{'caches':8}" + "".join(f"{name:>10}" for name in ("page", "progress", *WANTED)))
    with tempfile.TemporaryDirectory() as folder:
        caches = Path(folder)
        cold = first_frames(given.robot, given.world, caches)
        row("cold", cold)
        fill(caches)
        runs = [first_frames(given.robot, given.world, caches) for _ in range(given.repeats)]
        for seen in runs:
            row("warm", seen)


def environment(caches: Path) -> dict[str, str]:
    """Return the environment of a user whose caches are in that folder and whose browser opens nothing.

    Python's own cache of compiled source is among them: the first start may write it, the next ones read it.
    """
    own = {"NUMBA_CACHE_DIR": "numba", "XDG_CACHE_HOME": "user", "PYTHONPYCACHEPREFIX": "bytecode"}
    inherited = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    folders = {key: str(caches / name) for key, name in own.items()}
    return {**inherited, **folders, "PYTHONPATH": str(SOURCE), "BROWSER": "true"}


def fill(caches: Path) -> None:
    """Wait for the compilation that the cold start began."""
    code = "from rich.console import Console; from chefbot.kernels import precompile as p; p.compile_kernels(Console())"  # noqa: E501
    subprocess.run(
        [sys.executable, "-c", code], env=environment(caches), check=True, stdout=subprocess.DEVNULL
    )


if __name__ == "__main__":
    main()
