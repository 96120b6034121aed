"""NavFn's A* in C++ (navfn.cpp), compiled for a bench and called by ctypes."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SOURCE = Path(__file__).with_name("navfn.cpp")


class NavFn:
    """The planner with its arrays for costmaps of one size."""

    def __init__(self, shape: tuple[int, int]) -> None:
        self._library = _library()
        self._handle = self._library.navfn_create(shape[1], shape[0])

    def potential(self, cells: NDArray[np.uint8], start: tuple[int, int], goal: tuple[int, int]) -> float:
        """Return the potential of the start, 1e10 without a path; start and goal are (row, column)."""
        pointer = np.ascontiguousarray(cells).ctypes.data_as(ctypes.c_void_p)
        return float(self._library.navfn_a_star(self._handle, pointer, start[1], start[0], goal[1], goal[0]))

    def close(self) -> None:
        """Release the arrays."""
        self._library.navfn_destroy(self._handle)


def _library() -> Any:
    """Compile the source as Nav2's packages are, with -O2, and load it."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "navfn.so"
        subprocess.run(
            ["g++", "-O2", "-std=c++17", "-shared", "-fPIC", str(SOURCE), "-o", str(file)], check=True
        )
        library = ctypes.CDLL(str(file))
    library.navfn_create.restype = ctypes.c_void_p
    library.navfn_destroy.argtypes = [ctypes.c_void_p]
    library.navfn_a_star.restype = ctypes.c_float
    library.navfn_a_star.argtypes = [ctypes.c_void_p, ctypes.c_void_p, *[ctypes.c_int] * 4]
    return library
