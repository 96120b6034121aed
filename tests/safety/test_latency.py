"""The measured latency of the wheels: from commands and odometry, and never from what does not show it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.safety.latency import LatencyEstimator

PERIOD, MAX_SPEED, INITIAL = 0.05, 0.35, 0.15


def ramps(seed: int = 7, steps: int = 20) -> NDArray[np.float64]:
    """Return commanded speeds: ramps between random ones. Even seeds chose the window; this is of an odd one."""
    speeds = np.repeat(np.random.default_rng(seed).uniform(-MAX_SPEED, MAX_SPEED, steps), 10)
    return np.convolve(speeds, np.ones(8) / 8, "same")


def estimate(commanded: NDArray[np.float64], measured: NDArray[np.float64]) -> LatencyEstimator:
    estimator = LatencyEstimator(PERIOD, MAX_SPEED, INITIAL)
    for pair in zip(commanded.tolist(), measured.tolist(), strict=True):
        estimator.process(*pair)
    return estimator


def lagging(speeds: NDArray[np.float64], lag: int) -> NDArray[np.float64]:
    return np.concatenate([np.full(lag, speeds[0]), speeds[: len(speeds) - lag]])


@pytest.mark.parametrize("lag", [0, 1, 2, 6, 10])
def test_the_latency_of_the_wheels_is_measured(lag: int) -> None:
    """Up to half a second; the speed that stays constant in the end takes nothing back."""
    speeds = ramps()
    speeds = np.concatenate([speeds, np.full(100, speeds[-1])])
    noise = 0.005 * np.random.default_rng(9).standard_normal(len(speeds))
    assert estimate(speeds, lagging(speeds, lag) + noise).latency == pytest.approx(PERIOD * lag, abs=0.02)


@pytest.mark.parametrize("speed", [0.0, 0.2])
def test_a_constant_speed_shows_no_latency(speed: float) -> None:
    constant = np.full(100, speed)
    assert estimate(constant, constant).latency == INITIAL


def test_a_small_change_of_speed_shows_no_latency() -> None:
    """A tenth of the maximum speed has to change; less drowns in noise."""
    step = np.concatenate([np.zeros(30), np.full(40, 0.1 * MAX_SPEED - 0.001)])
    assert estimate(step, lagging(step, 8)).latency == INITIAL
    step *= 1.5
    assert estimate(step, lagging(step, 8)).latency > INITIAL


def test_forty_commands_are_needed_and_count() -> None:
    """The window is two seconds: nothing is judged before, and what is older is forgotten."""
    speeds = ramps()
    assert estimate(speeds[:39], lagging(speeds, 8)[:39]).latency == INITIAL
    assert estimate(speeds[:40], lagging(speeds, 8)[:40]).latency == pytest.approx(
        INITIAL + 0.2 * (8 * PERIOD - INITIAL)
    )


def test_a_pushed_or_slipping_robot_teaches_nothing() -> None:
    """The measured speed that no latency explains by half does not count."""
    speeds = ramps()
    pushed = 0.3 * (-1.0) ** np.arange(len(speeds))
    assert estimate(speeds, pushed).latency == INITIAL
    assert estimate(np.zeros(200), pushed).latency == INITIAL
    assert estimate(speeds, lagging(speeds, 8) + 0.3 * pushed).latency == pytest.approx(8 * PERIOD, abs=0.05)


def test_a_short_jerk_shows_no_latency() -> None:
    """The speed has to differ from the commanded one for a while, not for one period."""
    jerk = np.zeros(80)
    jerk[30] = 0.12 * MAX_SPEED
    assert estimate(jerk, lagging(jerk, 8)).latency == INITIAL


@pytest.mark.parametrize(("deviation", "disturbed"), [(0, False), (8, False), (9, True)])
def test_the_limits_themselves_still_count(deviation: int, disturbed: bool) -> None:
    """A lag as visible as MIN_ERROR, and half of the error explained; all numbers are exact."""
    estimator = LatencyEstimator(1 / 16, 10.0, 0.0)
    for k in range(40):
        estimator.process(float(k >= 12), (k >= 20) + float(k >= 40 - deviation))
    assert estimator.latency == (0.0 if disturbed else pytest.approx(0.2 * 8 / 16))


def test_speeds_that_are_not_numbers_teach_nothing() -> None:
    speeds = ramps()
    measured = lagging(speeds, 2)
    measured[::30] = np.nan
    assert estimate(speeds, measured).latency == INITIAL
