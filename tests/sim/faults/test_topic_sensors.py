"""Tests the faults that the simulator injects between a sensor and its topic."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from chefbot.errors import UserError
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.sim.faults.events import SensorFault
from chefbot.sim.faults.schedule import parse_request
from chefbot.sim.faults.topic_sensors import faulty_camera, faulty_lidar

FAULT_DELAY_NS = 1_000_000_000
NOISE_FRACTION = 0.3
"""Defaults of the faults `late` and `noise`."""
BEAMS = 36
STEP = 2 * np.pi / BEAMS


def scan(stamp_ns: int, distance: float) -> LaserScan:
    ranges = np.full(BEAMS, distance, np.float32)
    return LaserScan(Header.of(stamp_ns, "laser"), -np.pi, np.pi - STEP, STEP, ranges=ranges)


def fault_of(word: str) -> SensorFault:
    event = parse_request(f"{word} lidar", 0)
    assert isinstance(event, SensorFault)
    return event


def published_with(fault: str, count: int = 30) -> list[LaserScan]:
    found: list[LaserScan] = []
    sensor = faulty_lidar(found.append, np.random.default_rng(1))
    sensor.send(scan(0, 1.0), 0)
    found.clear()
    sensor.faults = () if fault == "none" else (fault_of(fault),)
    for n in range(1, count + 1):
        sensor.send(scan(n * 100_000_000, 1.0 + n), n * 100_000_000)
    return found


def test_without_a_fault_messages_pass_unchanged() -> None:
    assert [message.ranges[0] for message in published_with("none")] == [1.0 + n for n in range(1, 31)]


def test_a_stopped_sensor_publishes_nothing() -> None:
    assert published_with("stop") == []


def test_a_frozen_sensor_repeats_its_last_data_with_new_stamps() -> None:
    found = published_with("freeze")
    assert {float(message.ranges[0]) for message in found} == {1.0}
    assert all(a.header.stamp.ns < b.header.stamp.ns for a, b in pairwise(found))


def test_late_data_keep_their_stamp_and_come_after_the_delay() -> None:
    found = published_with("late")
    assert [message.header.stamp.ns for message in found] == [n * 100_000_000 for n in range(1, 21)]
    assert len(found) == 30 - FAULT_DELAY_NS // 100_000_000


def test_noise_has_the_given_share_of_the_range() -> None:
    errors = np.concatenate(
        [message.ranges / (1.0 + n) - 1.0 for n, message in enumerate(published_with("noise", 200), 1)]
    )
    assert errors.std() == pytest.approx(NOISE_FRACTION, rel=0.05)
    assert abs(errors.mean()) < 0.02


def test_half_blind_removes_half_of_a_scan_and_an_image() -> None:
    (first, *_) = published_with("half_blind")
    assert np.array_equal(np.isnan(first.ranges), np.cos(first.angles) > 0.0)
    images: list[Image] = []
    camera = faulty_camera(images.append, np.random.default_rng(1))
    camera.faults = (fault_of("half_blind"),)
    camera.send(Image.of(Header(), "32FC1", np.ones((4, 6), np.float32)), 0)
    depth = images[0].data.view(np.float32).reshape(4, 6)
    assert np.isnan(depth[:, :3]).all() and (depth[:, 3:] == 1.0).all()


def test_an_unknown_fault_is_rejected_with_the_choices() -> None:
    with pytest.raises(UserError, match=r"'half_blnd'.*half_blind"):
        parse_request("half_blnd lidar", 0)
