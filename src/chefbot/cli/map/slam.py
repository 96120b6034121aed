"""`chefbot slam`: a recorded log to a map."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from chefbot.config import read_bytes
from chefbot.errors import ChefbotError, UserError
from chefbot.runtime.clock import wall_ns
from chefbot.slam.carmen import CarmenOdom, CarmenScan, parse
from chefbot.slam.offline import SlamResult, run_log, trajectory_tum
from chefbot.slam.params import GmappingParams
from chefbot.storage.atomic_files import make_folder
from chefbot.storage.map_files import map_png, save_map

MAX_LOG_BYTES = 2_000_000_000
console = Console(highlight=False)


def run_slam(path: Path, out: Path, particles: int, seed: int, max_range: float) -> None:
    """Read, map with progress, write trajectory and map."""
    records = parse(read_text(path))
    params = GmappingParams(particles=particles, seed=seed, max_range=max_range)
    began = wall_ns()
    try:
        result = _run(path, records, params)
    except ChefbotError as error:
        raise UserError(f"log {path}: {error}") from None
    took = (wall_ns() - began) / 1e9
    make_folder(out)
    trajectory = (out / "trajectory.tum", trajectory_tum(result).encode())
    picture = (out / "map.png", map_png(result.grid))
    save_map(out / "map", result.grid, companions=(trajectory, picture))
    if result.no_return is not None:
        least, share = result.no_return
        console.print(f"Ranges of {least:.2f} m and more are taken for no return: {share:.1%} of all beams.")
    console.print(f"{len(result.poses)} scans, {took:.1f} s; {out}/map.yaml, map.png, trajectory.tum")


def _run(path: Path, records: Iterator[CarmenOdom | CarmenScan], params: GmappingParams) -> SlamResult:
    """With a bar that shows how far it is."""
    with Progress(console=console) as progress:
        task = progress.add_task(f"mapping {path.name}", total=None)
        return run_log(
            records, params, lambda done, total: progress.update(task, completed=done, total=total)
        )


def read_text(path: Path) -> str:
    """The text of a log, gzip'ed or not."""
    data = read_bytes(path, "log", MAX_LOG_BYTES)
    try:
        if data[:2] == b"\x1f\x8b":
            data = _bounded_gunzip(data, path)
        return data.decode("ascii")
    except (OSError, EOFError, zlib.error) as error:
        raise UserError(f"log {path} is a damaged or cut-off gzip file: {error}") from None
    except UnicodeDecodeError:
        raise UserError(f"log {path} is not a CARMEN log: it is not text") from None


def _bounded_gunzip(data: bytes, path: Path) -> bytes:
    """At most MAX_LOG_BYTES come out: a small file can hold an absurd one."""
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        text = file.read(MAX_LOG_BYTES + 1)
    if len(text) > MAX_LOG_BYTES:
        raise UserError(f"log {path} unpacks to more than {MAX_LOG_BYTES} bytes; that is not a log of scans")
    return text
