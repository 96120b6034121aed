"""Whether Numba's caches hold all kernels: a file names them, for this source, its libraries, this CPU."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from pathlib import Path

import chefbot
from chefbot.storage.atomic_files import write_atomic


def stamp_path() -> Path:
    """In the user's cache folder (XDG_CACHE_HOME, else ~/.cache), named after what the kernels depend on."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.sha256("\n".join(_dependencies()).encode()).hexdigest()
    return Path(home) / "chefbot" / f"kernels-{digest[:16]}.json"


def all_there(stamp: Path) -> bool:
    """Whether the stamp exists and so do all the files that it names."""
    try:
        files = json.loads(stamp.read_bytes())
    except (OSError, ValueError):
        return False  # not there, not readable or cut off by a full disk: compile, and write it anew
    return bool(files) and all(Path(file).exists() for file in files)


def write_stamp(stamp: Path, files: Iterable[str]) -> None:
    """Remember that these files hold the kernels. OSError where that cannot be written."""
    stamp.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(stamp, json.dumps(sorted(files)).encode())


def _dependencies() -> Iterator[str]:
    """Numba compiles anew when a source file's time or size has changed, so these count, not the content."""
    from llvmlite.binding import get_host_cpu_name  # type: ignore[import-untyped]

    root = Path(chefbot.__file__).parent
    for path in sorted(root.rglob("*.py")):
        status = path.stat()
        yield f"{path} {status.st_mtime_ns} {status.st_size}"
    yield from (f"{name} {version(name)}" for name in ("numba", "numpy", "llvmlite"))
    yield f"{platform.python_version()} {get_host_cpu_name()}"
    yield from (f"{key}={value}" for key, value in sorted(os.environ.items()) if key.startswith("NUMBA_"))
