"""Nodes that measure from within how punctual a process is, and one that keeps it busy."""

from __future__ import annotations

import msgspec
import numpy as np

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.std_msgs import Float64
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import In, Node, NoParams, Out, every


class LatenessNode(Node):
    """Hears what a node of its own process says on `ticks` and tells when that was: wall minus loop, seconds.

    At real time the least of these is what is in time; the others are late by how much they exceed it.
    """

    params: NoParams
    ticks: In[Twist]
    offset: Out[Float64]

    def on_ticks(self, _: Twist) -> None:
        self.offset.publish(Float64((wall_ns() - self.now_ns) / 1e9))


def late_ms(offsets: list[float]) -> np.ndarray:
    """Of each in order, milliseconds behind the most punctual."""
    return (np.array(offsets) - min(offsets)) * 1e3


class BusyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    busy: bool = True


class BusyNode(Node):
    """Leaves its process no rest: it counts for nearly all of its period."""

    params: BusyParams

    @every(hz=10)
    def count(self) -> None:
        """Counting holds the interpreter, as a careless node would."""
        until = wall_ns() + 95_000_000
        while self.params.busy and wall_ns() < until:
            pass


class PonderParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    seconds: float = 3.0
    compiles: bool = False


class PonderNode(Node):
    """Is at one step for long, once: it counts, or compiles a kernel again and again."""

    params: PonderParams
    ticks: In[Twist]
    done: Out[Float64]

    def on_ticks(self, _: Twist) -> None:
        began = wall_ns()
        while (took := (wall_ns() - began) / 1e9) < self.params.seconds:
            if self.params.compiles:
                compile_a_kernel()
        self.done.publish(Float64(took))


def compile_a_kernel() -> None:
    """Some tenths of a second."""
    import numba

    def kernel(cells: np.ndarray) -> float:
        total = 0.0
        for i in range(cells.shape[0]):
            for j in range(cells.shape[1]):
                total += np.sqrt(cells[i, j]) if cells[i, j] > 0.0 else np.cos(cells[i, j])
        return total + np.sort(cells[0])[0]

    numba.njit(kernel)(np.ones((4, 4)))
