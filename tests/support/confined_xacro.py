"""The expansion of an untrusted xacro file in this process, after which the library is as it was for other tests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xacro

from chefbot.cli.robot.foreign.xacro_child import expand
from chefbot.cli.robot.foreign.xacro_files import PackageFiles


def expand_here(path: Path) -> str:
    """Return the URDF, as the confined process does. Raises UserError."""
    with _restored():
        return expand(path, PackageFiles(path))


@contextmanager
def _restored() -> Iterator[None]:
    """Undo what the confinement replaces in the library."""
    attributes, symbols = dict(vars(xacro)), dict(xacro._global_symbols)
    try:
        yield
    finally:
        vars(xacro).update(attributes)
        xacro._global_symbols.clear()
        xacro._global_symbols.update(symbols)
        xacro.filestack = None
