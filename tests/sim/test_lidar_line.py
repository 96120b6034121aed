"""Tests the simulated lidar behind its serial line: when its bytes arrive, and what its driver decodes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from chefbot.lidar.emulators import Ld19Emulator
from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.sim.lidar import RotatingLidar
from chefbot.sim.lidar_line import BITS_PER_BYTE, EmulatedLidar, LidarLine
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")
RATE = ROBOT.sensors.lidar.rate
MS = 1_000_000
STARTED = 1500 * MS
"""Time after which each lidar has been started by its driver, ns."""
KINDS = ["ld19", "rplidar_a1", "rplidar_c1", "ydlidar_x2", "ydlidar_tmini"]


@pytest.fixture(scope="module")
def sim() -> Simulation:
    made = Simulation(ROBOT, load_world("room"))
    made.kidnap(SE2(0.6, 0.2, 0.3))
    return made


def started(driver: str, sim: Simulation, begin: int = 0) -> EmulatedLidar:
    """Return a lidar that was commanded to scan."""
    lidar = EmulatedLidar(driver, RotatingLidar(sim, begin), begin)
    session = lidar.model.open()
    for now in range(begin, begin + STARTED, 5 * MS):
        lidar.receive(session.data_to_send(now), now)
        for time, data in lidar.bytes_until(now):
            session.receive_data(data, time)
    return lidar


@pytest.mark.parametrize("driver", KINDS)
def test_its_driver_decodes_the_room(driver: str, sim: Simulation) -> None:
    rotating = RotatingLidar(sim, 0)
    line, scans = LidarLine(driver, rotating, 0), []
    for tick in range(1, 181):
        rotating.follow(tick * 10 * MS)
        scans += line.advance(tick * 10 * MS)
    angles = lidar_angles(rotating.lidar)
    true = rotating.measure(angles, np.zeros(len(angles), np.int64))
    assert len(scans) >= 0.5 * RATE
    stamps = [scan.header.stamp.ns for scan in scans]
    gaps = [(b - a) / 1e9 for a, b in itertools.pairwise(stamps)]
    assert gaps == pytest.approx([1.0 / RATE] * len(gaps), rel=0.1)
    assert np.mean(gaps) == pytest.approx(1.0 / RATE, rel=0.01)
    for scan in scans:
        assert len(scan.ranges) == len(true) and scan.header.frame_id == "laser"
        both = np.isfinite(scan.ranges) & np.isfinite(true) & (true > rotating.lidar.range_min)
        assert both.sum() > 0.3 * len(true)
        error = np.abs(scan.ranges[both] - true[both])
        assert np.median(error) < 0.02 and np.quantile(error, 0.8) < 0.1


@pytest.mark.parametrize("driver", ["rplidar_a1", "ydlidar_tmini"])
def test_a_lidar_without_a_scan_request_is_silent(driver: str, sim: Simulation) -> None:
    lidar = EmulatedLidar(driver, RotatingLidar(sim, 0), 0)
    assert lidar.bytes_until(500 * MS) == []
    lidar.receive(b"", 500 * MS)
    assert lidar.bytes_until(600 * MS) == []


@pytest.mark.parametrize("driver", ["ld19", "rplidar_a1", "ydlidar_tmini"])
def test_bytes_arrive_in_order_when_the_line_has_sent_them(driver: str, sim: Simulation) -> None:
    lidar = started(driver, sim)
    arrived, now = [], STARTED
    for _ in range(40):
        before, now = now, now + 5 * MS
        part = lidar.bytes_until(now)
        assert all(time <= now for time, _ in part)
        arrived += part
        assert before < now
    times = [time for time, _ in arrived]
    assert times == sorted(times) and len(arrived) > 3
    sent, seconds = sum(len(data) for _, data in arrived[1:]), (times[-1] - times[0]) / 1e9
    assert sent * BITS_PER_BYTE <= 1.05 * lidar.model.baud * seconds, "no faster than the line"


@pytest.mark.parametrize("step", [1, 7, 100])
def test_how_often_bytes_are_taken_makes_no_difference(sim: Simulation, step: int) -> None:
    def taken(milliseconds: int) -> bytes:
        lidar, data = EmulatedLidar("ld19", RotatingLidar(sim, 0), 0), b""
        for now in range(milliseconds, 701, milliseconds):
            data += b"".join(part for _, part in lidar.bytes_until(now * MS))
        return data

    assert taken(step) == taken(700)


class FarRotating(RotatingLidar):
    """A lidar around which everything is as far as its range, or a little nearer or farther."""

    RANGES = ROBOT.sensors.lidar.range_max * np.linspace(0.5, 1.5, 12)

    def measure(self, bearings: np.ndarray, times_ns: np.ndarray) -> np.ndarray:
        assert len(bearings) == len(times_ns) == 12 and (np.diff(times_ns) > 0).all()
        return self.RANGES


def test_nothing_is_seen_beyond_the_range_of_the_lidar(
    sim: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[np.ndarray] = []

    def note(_, angles: np.ndarray, ranges: np.ndarray) -> bytes:
        seen.append(ranges)
        return bytes(len(angles))

    monkeypatch.setattr(Ld19Emulator, "_encode", note)
    EmulatedLidar("ld19", FarRotating(sim, 0), 0).bytes_until(10 * MS)
    assert seen
    for ranges in seen:
        assert np.isinf(ranges).tolist() == 6 * [False] + 6 * [True]
