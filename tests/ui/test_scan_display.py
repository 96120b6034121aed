"""Tests that a scan is shown if it shows something new, and not if it differs by noise only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from chefbot.maths.se2 import SE2
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.ui.display.scan_display import ScanDisplay

BEAMS = 360
POSE = SE2(1.0, 2.0, 3.1)


def scan(ranges: np.ndarray) -> LaserScan:
    increment = math.tau / BEAMS
    return LaserScan(Header.of(0, "laser"), -math.pi, math.pi, increment, ranges=ranges.astype(np.float32))


def changed(ranges: np.ndarray, beams: int, value: float) -> np.ndarray:
    other = ranges.copy()
    other[:beams] = value
    return other


@pytest.fixture
def room() -> np.ndarray:
    ranges = np.random.default_rng(1).uniform(1.0, 4.0, BEAMS)
    ranges[100:120] = np.inf
    return ranges


def shown(first: np.ndarray, *others: np.ndarray, pose: SE2 = POSE) -> bool:
    """Return whether any of the other scans is shown after the first."""
    calls: list[Any] = []
    display = ScanDisplay(lambda layer, view: calls.append((layer, view)))
    display.show("scan", POSE, scan(first))
    for other in others:
        display.show("scan", pose, scan(other))
    assert calls[0][0] == "scan"
    return len(calls) > 1


def test_noise_at_rest_is_nothing_new(room: np.ndarray) -> None:
    noise = np.random.default_rng(2).normal(0.0, 0.012, BEAMS)
    assert not shown(room, room + noise)
    assert not shown(room, *[changed(room, 5, 9.0)] * 2), "single beams at edges jump"


def test_noise_of_a_depth_camera_is_nothing_new(room: np.ndarray) -> None:
    """It grows with the square of the range, and some directions have no data, each time others."""
    rng = np.random.default_rng(3)

    def seen() -> np.ndarray:
        far = np.where(np.isfinite(room), 2.0 * room, 8.0)
        return np.where(rng.random(BEAMS) < 0.06, np.inf, rng.normal(far, 0.0025 * far**2))

    assert not shown(seen(), *(seen() for _ in range(100)))
    assert shown(seen(), *(changed(seen(), 12, 0.5) for _ in range(2))), "somebody who comes"


def test_data_missing_in_single_scans_is_nothing_new(room: np.ndarray) -> None:
    """A camera loses whole groups of directions at a far wall, each time others."""
    starts = np.random.default_rng(4).permutation(np.arange(120, BEAMS - 20, 20))
    gaps = [np.where((np.arange(BEAMS) - start) // 20 == 0, np.inf, room) for start in starts]
    assert not shown(room, *gaps)
    assert shown(room, gaps[0], gaps[0]), "a door that was opened"


@pytest.mark.parametrize("value", [0.5, math.inf, math.nan])
def test_somebody_who_comes_is_new(room: np.ndarray, value: float) -> None:
    assert shown(room, *[changed(room, 12, value)] * 2)


def test_somebody_who_walks_past_is_shown(room: np.ndarray) -> None:
    """At 1 m/s and 10 Hz, 2 m away, a person moves by 3 degrees a scan and covers 12."""
    walk = [np.where((np.arange(BEAMS) - 140 - 3 * step) // 12 == 0, 0.5, room) for step in range(30)]
    calls: list[Any] = []
    display = ScanDisplay(lambda *view: calls.append(view))
    for one in (room, *walk):
        display.show("scan", POSE, scan(one))
    assert len(calls) > 10


@pytest.mark.parametrize(
    "pose", [SE2(1.02, 2.0, 3.1), SE2(1.0, 2.0, 3.12), SE2(1.0, 2.0, 3.1 - math.tau + 0.01)]
)
def test_a_scan_from_elsewhere_is_new(room: np.ndarray, pose: SE2) -> None:
    assert shown(room, room, pose=pose)
    assert not shown(room, room, pose=SE2(1.0, 2.0, 3.1 - math.tau))


def test_slow_changes_add_up(room: np.ndarray) -> None:
    calls: list[Any] = []
    display = ScanDisplay(lambda *shown: calls.append(shown))
    for step in range(11):
        display.show("scan", POSE, scan(room - 0.01 * step))
    assert len(calls) == 2, "each is compared with the one that is shown"


def test_nothing_is_shown_without_a_pose_and_layers_do_not_mix(room: np.ndarray) -> None:
    calls: list[tuple[Any, ...]] = []
    display = ScanDisplay(lambda *shown: calls.append(shown))
    display.show("scan", None, scan(room))
    display.show("scan", POSE, scan(room))
    display.show("obstacles", POSE, scan(room))
    assert [layer for layer, _ in calls] == ["scan", "obstacles"]
