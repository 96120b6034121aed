"""`chefbot map slam`: build a map from a recorded log."""

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
    """Build a map from a CARMEN log with a progress display; write trajectory and map into `out`.

    Raises UserError if the log is invalid or the folder cannot be written.
    """
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
        minimum, share = result.no_return
        console.print(f"Ranges of {minimum:.2f} m and more count as no return: {share:.1%} of all beams.")
    console.print(f"{len(result.poses)} scans, {took:.1f} s; {out}/map.yaml, map.png, trajectory.tum")


def _run(path: Path, records: Iterator[CarmenOdom | CarmenScan], params: GmappingParams) -> SlamResult:
    """Run SLAM over the records with a progress bar."""
    with Progress(console=console) as progress:
        task = progress.add_task(f"mapping {path.name}", total=None)
        return run_log(
            records, params, lambda done, total: progress.update(task, completed=done, total=total)
        )


def read_text(path: Path) -> str:
    """Return the text of a log, gzip-compressed or not. Raises UserError if it is not ASCII text."""
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
    """Decompress at most MAX_LOG_BYTES: a small file can contain an enormous one."""
    with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
        text = file.read(MAX_LOG_BYTES + 1)
    if len(text) > MAX_LOG_BYTES:
        raise UserError(
            f"log {path} unpacks to more than {MAX_LOG_BYTES} bytes; that is not a log of laser scans"
        )
    return text
