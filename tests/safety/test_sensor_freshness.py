"""A twist needs data that are young, new and not blind; legal data of a healthy sensor never stop the robot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.maths.se2 import SE2
from chefbot.safety.sensor_freshness import (
    CLOCK_TOLERANCE_NS,
    VALID_MESSAGES_REQUIRED,
    ObstacleSensorMonitor,
    SensorView,
)

BEAMS = 360
MS = 1_000_000
HERE = SE2(0.0, 0.0, 0.0)


def view(stamp_ns: int, ranges: np.ndarray) -> SensorView:
    ranges = np.asarray(ranges, np.float32)
    met = np.isfinite(ranges) & (ranges > 0.0)
    return SensorView(
        stamp_ns, ranges[:, None], met, met, ~(ranges > 0.0), bool((ranges[met] < 4.0).any()), "laser"
    )


class Bench:
    """A lidar of 10 Hz in a room, its clock and the robot's pose."""

    def __init__(self, noise: float = 0.01, quantum: float = 0.0) -> None:
        self.watch = ObstacleSensorMonitor("lidar", 0.1)
        self.rng, self.noise, self.quantum = np.random.default_rng(2), noise, quantum
        self.now_ns, self.pose = 1_000_000_000, HERE
        self.walls = self.rng.uniform(1.0, 3.0, BEAMS)

    def measure(self) -> np.ndarray:
        ranges = self.walls - self.pose.x + self.noise * self.rng.standard_normal(BEAMS)
        return np.round(ranges / self.quantum) * self.quantum if self.quantum else ranges

    def send(self, ranges: np.ndarray | None = None, age_ms: float = 0.0, placed: bool = True) -> None:
        stamp = self.now_ns - round(age_ms * MS)
        self.watch.process_view(
            view(stamp, self.measure() if ranges is None else ranges), self.now_ns, self.pose
        )
        if placed:
            self.watch.note_marked(stamp)

    def run(
        self,
        seconds: float,
        period_ms: float = 100.0,
        ranges: np.ndarray | None = None,
        age_ms: float = 0.0,
        speed: float = 0.0,
        placed: bool = True,
    ) -> list[str]:
        """Faults at 10 Hz while the sensor sends each `period_ms` (0: never)."""
        faults, begun, sent = [], self.now_ns, 0
        for tick in range(1, round(seconds * 100) + 1):
            self.now_ns = begun + tick * 10 * MS
            self.pose = SE2(self.pose.x + 0.01 * speed, 0.0, 0.0)
            if period_ms and tick * 10 >= (sent + 1) * period_ms:
                sent += 1
                self.send(ranges, age_ms, placed)
            if tick % 10 == 5:
                faults.append(self.watch.fault(self.now_ns, self.pose))
        return faults

    @property
    def fault(self) -> str:
        return self.watch.fault(self.now_ns, self.pose)


@pytest.fixture
def bench() -> Bench:
    made = Bench()
    made.run(1.0)
    assert not made.fault
    return made


def test_no_motion_is_allowed_before_the_first_data() -> None:
    bench = Bench()
    assert "has not sent anything" in bench.fault
    assert all(bench.run(0.4))
    assert not any(bench.run(2.0)[3:])


@pytest.mark.parametrize("speed", [0.0, 0.35])
@pytest.mark.parametrize(("noise", "quantum"), [(0.01, 0.0), (0.002, 0.001), (0.0, 0.0), (0.0, 0.001)])
def test_a_healthy_sensor_never_stops_the_robot(noise: float, quantum: float, speed: float) -> None:
    """With and without noise, in millimetres, standing and driving."""
    bench = Bench(noise, quantum)
    bench.run(1.0)
    assert not any(bench.run(3.0, speed=speed)) and not bench.watch.blind()


def test_silence_is_reported_within_three_periods_and_a_tick(bench: Bench) -> None:
    faults = bench.run(1.0, period_ms=0)
    assert not any(faults[:3]) and all(faults[3:])
    assert all("lidar has sent nothing" in fault for fault in faults[3:])


def test_silence_after_data_with_latency_is_not_lateness(bench: Bench) -> None:
    bench.run(1.0, age_ms=80.0)
    faults = [fault for fault in bench.run(1.0, period_ms=0) if fault]
    assert faults and all("has sent nothing" in fault for fault in faults)


@pytest.mark.parametrize(("period_ms", "stands"), [(167.0, False), (330.0, True)])
def test_half_the_sensor_rate_is_accepted_and_a_third_is_not(period_ms: float, stands: bool) -> None:
    bench = Bench()
    assert {bool(fault) for fault in bench.run(8.0, period_ms)[30:]} == {stands}


def test_one_message_does_not_clear_a_silence_fault(bench: Bench) -> None:
    bench.run(1.0, period_ms=0)
    for _ in range(VALID_MESSAGES_REQUIRED - 1):
        bench.run(0.1)
        assert bench.fault
    bench.run(1.0, period_ms=0)
    assert all(bench.run(0.4))
    assert not any(bench.run(1.0)[1:])


@pytest.mark.parametrize(("age_ms", "word"), [(3000.0, "late"), (400.0, "late"), (-300.0, "future")])
def test_stale_and_future_stamps_are_faults(bench: Bench, age_ms: float, word: str) -> None:
    faults = bench.run(1.0, age_ms=age_ms)
    assert word in faults[-1]
    assert not any(bench.run(2.0, age_ms=80.0)[8:])


def test_repeated_noisy_data_are_frozen_even_at_standstill(bench: Bench) -> None:
    faults = bench.run(1.0, ranges=bench.measure())
    assert "frozen" in faults[-1] and not any(faults[:3]) and all(faults[5:])
    assert not any(bench.run(2.0)[8:])


def test_repeated_noiseless_data_are_frozen_only_after_motion() -> None:
    bench = Bench(noise=0.0)
    bench.run(2.0)
    still = bench.measure()
    assert not any(bench.run(2.0, ranges=still))
    assert bench.run(1.0, ranges=still, speed=0.2)[-1].startswith("The lidar is frozen")


def test_moving_people_do_not_make_a_noiseless_sensor_noisy() -> None:
    """Who walks by changes a part of the beams; when they have left all is equal again."""
    bench = Bench(noise=0.0)
    bench.run(1.0)
    for step in range(20):
        bench.walls[step * 5 : step * 5 + 100] = 0.8
        bench.run(0.1)
    assert not any(bench.run(3.0))


def test_a_settling_robot_does_not_make_a_noiseless_sensor_noisy() -> None:
    bench = Bench(noise=0.0)
    bench.run(1.0)
    for _ in range(10):
        bench.walls += 0.0001
        bench.run(0.1)
    bench.walls += 0.01
    assert not any(bench.run(3.0))


@pytest.mark.parametrize("speed", [0.0, 0.35])
def test_an_empty_hall_without_returns_is_valid(speed: float) -> None:
    bench = Bench()
    nothing = np.full(BEAMS, np.inf)
    bench.run(1.0, ranges=nothing)
    assert not any(bench.run(3.0, ranges=nothing, speed=speed)) and not bench.watch.blind()


def test_walls_do_not_vanish_at_once(bench: Bench) -> None:
    bench.run(1.0, ranges=np.full(BEAMS, np.inf))
    assert bench.watch.blind()
    bench.run(0.2)
    assert not bench.watch.blind()


@pytest.mark.parametrize("nothing", [np.nan, 0.0, -np.inf])
def test_a_quarter_without_data_is_blind_scattered_dropouts_not(bench: Bench, nothing: float) -> None:
    ranges = bench.measure()
    ranges[np.random.default_rng(4).random(BEAMS) < 0.3] = nothing
    bench.send(ranges)
    assert not bench.watch.blind()
    ranges[90:180] = nothing
    bench.send(ranges)
    assert bench.watch.blind()


def test_data_outside_the_costmap_count_as_none(bench: Bench) -> None:
    assert "no transform from laser to odom for the lidar;" in bench.run(1.0, placed=False)[-1]


@given(
    st.lists(st.tuples(st.integers(1, 700), st.booleans(), st.integers(-400, 1200)), min_size=1, max_size=40)
)
def test_no_twist_without_recent_and_changing_data(steps: list[tuple[int, bool, int]]) -> None:
    """Per message: milliseconds since the last one, whether its data are new, milliseconds of age."""
    bench = Bench()
    bench.run(1.0)
    ranges, newest = bench.measure(), bench.now_ns
    bench.send(ranges)
    for wait_ms, new, age_ms in steps:
        for _ in range(wait_ms // 50):
            bench.now_ns += 50 * MS
            if not bench.fault:
                assert bench.now_ns - newest <= bench.watch.limit_ns
                assert bench.watch._last is not None
                assert (
                    -CLOCK_TOLERANCE_NS <= bench.now_ns - bench.watch._last.stamp_ns <= bench.watch.limit_ns
                )
        ranges = bench.measure() if new else ranges
        newest = max(newest, bench.now_ns - age_ms * MS) if new else newest
        bench.send(ranges, age_ms)
