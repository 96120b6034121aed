"""Nodes that measure how late the callbacks of a process are, and nodes that keep it busy."""

from __future__ import annotations

import threading

import msgspec
import numpy as np

from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.runtime.clock import wall_ns
from chefbot.runtime.node import In, Node, NoParams, Out, every
from chefbot.runtime.transform_buffer import TransformError


class LatenessNode(Node):
    """Publishes for each message on `ticks` the wall time minus the loop's time, seconds.

    The publisher of `ticks` has to run in the same process. At a real-time factor of 1 the smallest offset is that of
    a punctual callback; any other callback is late by the difference to it.
    """

    params: NoParams
    ticks: In[Twist]
    offset: Out[Float64]

    def on_ticks(self, _: Twist) -> None:
        self.offset.publish(Float64((wall_ns() - self.now_ns) / 1e9))


def late_ms(offsets: list[float]) -> np.ndarray:
    """Return the lateness of each offset relative to the smallest, ms, shape (N,)."""
    return (np.array(offsets) - min(offsets)) * 1e3


class BusyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    busy: bool = True
    in_thread: bool = False
    """Use a thread of its own, so that the other nodes of the process continue."""


class BusyNode(Node):
    """Computes for 95 ms of each period of 100 ms, or without pause in a thread."""

    params: BusyParams

    def start(self) -> None:
        """Start the thread, which holds the interpreter lock most of the time."""
        self._ended = threading.Event()
        if self.params.busy and self.params.in_thread:
            threading.Thread(target=self._compute, name="busy", daemon=True).start()

    def stop(self) -> None:
        self._ended.set()
        super().stop()

    @every(hz=10)
    def compute(self) -> None:
        until = wall_ns() + 95_000_000
        while self.params.busy and not self.params.in_thread and wall_ns() < until:
            pass

    def _compute(self) -> None:
        while not self._ended.is_set():
            pass


class RoomScanNode(Node):
    """Simulates sensors in an empty room of 6 m by 5 m at the pose of the odometry, for a robot without a world.

    The lidar scans the walls; the depth camera detects only floor.
    """

    params: NoParams
    scan: Out[LaserScan]
    obstacles: Out[ObstacleScan]

    @every(hz=10)
    def publish_scans(self) -> None:
        lidar = self.robot.sensors.lidar
        assert lidar is not None
        try:
            x, y, yaw = self.tf.lookup("odom", "laser")
        except TransformError:
            return  # there is no odometry yet
        angles = np.linspace(-np.pi, np.pi, lidar.beams, endpoint=False)
        along, across = np.cos(angles + yaw), np.sin(angles + yaw)
        with np.errstate(divide="ignore"):
            walls = [
                np.abs((np.copysign(half, d) - at) / d) for half, at, d in ((3.0, x, along), (2.5, y, across))
            ]
        ranges = np.minimum(*walls).astype(np.float32)
        header, step = Header.of(self.now_ns, "laser"), float(angles[1] - angles[0])
        limits = (lidar.range_min, lidar.range_max)
        self.scan.publish(
            LaserScan(
                header, float(angles[0]), float(angles[-1]), step, 0.0, 1.0 / lidar.rate, *limits, ranges
            )
        )
        far, floor = np.full(160, np.inf, np.float32), np.full(160, 2.0, np.float32)
        self.obstacles.publish(ObstacleScan(header, -0.5, 1.0 / 160, 8.0, far, 0.5 * floor, floor))


class LongCallbackParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    seconds: float = 3.0
    compiles: bool = False


class LongCallbackNode(Node):
    """Has a callback that takes `seconds`, in which it computes or compiles kernels."""

    params: LongCallbackParams
    ticks: In[Twist]
    done: Out[Float64]

    def on_ticks(self, _: Twist) -> None:
        began = wall_ns()
        while (took := (wall_ns() - began) / 1e9) < self.params.seconds:
            if self.params.compiles:
                compile_a_kernel()
        self.done.publish(Float64(took))


def compile_a_kernel() -> None:
    """Compile a function with Numba, which takes some tenths of a second."""
    import numba

    def kernel(cells: np.ndarray) -> float:
        total = 0.0
        for i in range(cells.shape[0]):
            for j in range(cells.shape[1]):
                total += np.sqrt(cells[i, j]) if cells[i, j] > 0.0 else np.cos(cells[i, j])
        return total + np.sort(cells[0])[0]

    numba.njit(kernel)(np.ones((4, 4)))
