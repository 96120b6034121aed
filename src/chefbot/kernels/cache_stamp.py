"""Stamp file that records whether Numba's cache is complete for this source, its libraries and CPU."""

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


def stamp_path(group: str = "") -> Path:
    """Return the path of the stamp in the user's cache folder (XDG_CACHE_HOME, else ~/.cache).

    Its name has a hash of all that the kernels depend on, and the group of kernels that it is of; empty: those of the
    demo.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.sha256("\n".join(_dependencies()).encode()).hexdigest()
    return Path(home) / "chefbot" / f"kernels-{digest[:16]}{group}.json"


def is_complete(stamp: Path) -> bool:
    """Return whether the stamp exists and so do all the files that it names."""
    try:
        files = json.loads(stamp.read_bytes())
    except (OSError, ValueError):
        return False  # missing, unreadable or cut off by a full disk: compile, and write it again
    return bool(files) and all(Path(file).exists() for file in files)


def write_stamp(stamp: Path, files: Iterable[str]) -> None:
    """Record that these files hold the kernels. Raises OSError if that cannot be written."""
    stamp.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(stamp, json.dumps(sorted(files)).encode())


def _dependencies() -> Iterator[str]:
    """Yield what the cache depends on; source files by time and size, not content, as Numba does."""
    from llvmlite.binding import get_host_cpu_name  # type: ignore[import-untyped]

    root = Path(chefbot.__file__).parent
    for path in sorted(root.rglob("*.py")):
        status = path.stat()
        yield f"{path} {status.st_mtime_ns} {status.st_size}"
    yield from (f"{name} {version(name)}" for name in ("numba", "numpy", "llvmlite"))
    yield f"{platform.python_version()} {get_host_cpu_name()}"
    yield from (f"{key}={value}" for key, value in sorted(os.environ.items()) if key.startswith("NUMBA_"))
