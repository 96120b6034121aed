"""Lidar drivers on damaged bytes, and their share of a core on clean ones.

`python bench/bench_lidar_fuzz.py --bytes 100000000 --seed 1 --drivers ld19,rplidar_c1`: pieces of a stream of a room
with changed, lost and new bytes are decoded; every range must be one of the room, and within a revolution of clean
bytes after each piece the driver must deliver samples again. The exit code is 1 if one is not.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.lidar.wires import OPEN, Wire, room

from chefbot.lidar.laser_scan import scan_of
from chefbot.lidar.models import LIDARS
from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.revolutions import Samples
from chefbot.lidar.session import LidarError
from chefbot.robot.load import load_robot

DAMAGED_REVOLUTIONS = 2
ANGLE, RANGE = 0.06, 0.02
"""Tolerances of a bearing, rad, and of a range, m: quantization and triangulation."""


def wrong_ranges(part: Samples) -> int:
    """Return how many ranges are not those of the room."""
    found = np.isfinite(part.ranges)
    near = np.stack([room(part.bearings + d) for d in np.linspace(-ANGLE, ANGLE, 13)])
    right = (part.ranges >= near.min(axis=0) - RANGE) & (part.ranges <= near.max(axis=0) + RANGE)
    nothing = np.abs(part.bearings) > math.pi - OPEN - 0.2
    return int((found & ~right).sum() + (~found & ~nothing).sum())


def damaged(stream: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes of which some are changed, lost, or new."""
    out = bytearray(stream)
    for _ in range(int(rng.integers(1, 12))):
        at, kind = int(rng.integers(len(out))), int(rng.integers(4))
        if kind == 0:
            out[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del out[at : at + int(rng.integers(1, 200))]
        elif kind == 2:
            out[at:at] = rng.bytes(int(rng.integers(1, 200)))
        else:
            out[at : at + 40] = rng.bytes(40)
    return bytes(out)


class Fuzzed:
    """One driver and an emulated lidar that goes on sending."""

    def __init__(self, driver: str, seed: int) -> None:
        self.wire, self.rng = Wire(driver), np.random.default_rng([seed, len(driver)])
        self.wire.start()
        self.wire.run(1)
        lidar = self.wire.lidar
        self.per_revolution = math.ceil(lidar.sample_rate / lidar.revolution_rate / lidar.samples)
        self.wrong = self.samples = self.late = self.errors = self.bytes = self.pieces = 0

    def piece(self) -> None:
        """Decode two damaged revolutions and a clean one."""
        self.pieces += 1
        session, wire = self.wire.session, self.wire
        begin = b"".join(wire.frame() for _ in range(DAMAGED_REVOLUTIONS * self.per_revolution))
        data, now_ns = damaged(begin, self.rng), wire.now_ns
        after = b"".join(wire.frame() for _ in range(self.per_revolution))
        self.bytes += len(data) + len(after)
        try:
            parts = session.receive_data(data, now_ns)
            parts_after = session.receive_data(after, wire.now_ns)
        except LidarError:
            self.errors += 1
            return
        self._check(parts + parts_after)
        self.late += not parts_after

    def _check(self, parts: list[Samples]) -> None:
        if not parts:
            return
        joined = Samples(*(np.concatenate(values) for values in zip(*parts, strict=True)))
        self.wrong += wrong_ranges(joined)
        self.samples += len(joined.ranges)


def cpu_share(driver: str, seconds: float = 20.0) -> float:
    """Return the share of a core that decoding and scans of clean bytes take."""
    wire, robot = Wire(driver), load_robot("chefbot_lidar")
    assert robot.sensors.lidar is not None
    own_body = OwnBody(robot.sensors.lidar, robot.footprint)
    wire.start()
    frames = []
    while (wire.now_ns - 1_000_000_000) / 1e9 < seconds:
        frames.append((wire.frame(), wire.now_ns))
    session, revolutions = wire.session, wire.revolutions
    begun = time.process_time()
    for first in range(0, len(frames), 4):  # a read returns what has come in some milliseconds
        some = frames[first : first + 4]
        for part in session.receive_data(b"".join(data for data, _ in some), some[-1][1]):
            for revolution in revolutions.push(part):
                scan_of(revolution, robot.sensors.lidar, own_body, "laser")
    return (time.process_time() - begun) / seconds


def main() -> None:
    """Print a line for each driver."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bytes", type=int, default=300_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drivers", default=",".join(LIDARS))
    options = parser.parse_args()
    failed = False
    for driver in options.drivers.split(","):
        fuzzed, begun = Fuzzed(driver, options.seed), time.monotonic()
        while fuzzed.bytes < options.bytes:
            fuzzed.piece()
        failed |= bool(fuzzed.wrong or fuzzed.late)
        print(
            f"{driver:14} {fuzzed.bytes:11,} bytes, {fuzzed.pieces} pieces, {fuzzed.samples:,} samples: "
            f"{fuzzed.wrong} wrong, {fuzzed.late} late, {fuzzed.errors} refused; "
            f"{100.0 * cpu_share(driver):.1f} % of a core; {time.monotonic() - begun:.0f} s",
            flush=True,
        )
    sys.exit(int(failed))


if __name__ == "__main__":
    main()
