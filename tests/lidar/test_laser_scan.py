"""Revolutions as scans: the beams of the robot file, their times, and what is not known."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.lidar.laser_scan import scan_of
from chefbot.lidar.own_body import OwnBody
from chefbot.lidar.revolutions import RevolutionAssembler, Samples, bearings_of
from chefbot.robot.load import load_robot

from .wires import Wire, room

ROBOT = load_robot("chefbot_lidar")
LIDAR = ROBOT.sensors.lidar
assert LIDAR is not None
BODY = OwnBody(LIDAR, ROBOT.footprint)


def revolution_of(count: int, period_ns: int = 100_000_000) -> Samples:
    """Return a revolution in the room that ends at 1 s."""
    bearings = math.pi - (np.arange(count) + 0.5) * 2.0 * math.pi / count
    times = 1_000_000_000 - period_ns + ((np.arange(count) + 0.5) * period_ns / count).astype(np.int64)
    return Samples(bearings, room(bearings), times)


@pytest.mark.parametrize("count", [220, 360, 448, 3200])
def test_each_beam_has_the_range_in_its_direction(count: int) -> None:
    scan = scan_of(revolution_of(count), LIDAR, BODY, "laser")
    assert len(scan.ranges) == LIDAR.beams
    assert not np.isnan(scan.ranges).any()
    width = math.pi / min(count, LIDAR.beams) + 0.005
    near = np.stack([room(scan.angles + d) for d in np.linspace(-width, width, 21)])
    assert (scan.ranges >= near.min(axis=0) - 0.01).all() and (scan.ranges <= near.max(axis=0) + 0.01).all()


def test_the_time_increment_gives_each_beam_its_time() -> None:
    revolution = revolution_of(360)
    scan = scan_of(revolution, LIDAR, BODY, "laser")
    times = scan.header.stamp.ns + np.arange(LIDAR.beams) * scan.time_increment * 1e9
    true = np.interp(scan.angles, revolution.bearings[::-1], revolution.times_ns[::-1].astype(float))
    assert np.abs(times - true).max() < 1e6
    assert scan.scan_time == pytest.approx(0.1, rel=1e-3)


def test_a_direction_without_samples_has_no_range() -> None:
    revolution = revolution_of(400)
    kept = np.abs(revolution.bearings - 1.0) > 0.2
    scan = scan_of(Samples(*(column[kept] for column in revolution)), LIDAR, BODY, "laser")
    unknown = np.abs(scan.angles - 1.0) < 0.17
    assert (
        np.isnan(scan.ranges[unknown]).all()
        and not np.isnan(scan.ranges[np.abs(scan.angles - 1.0) > 0.25]).any()
    )


def test_too_near_is_unknown_and_too_far_is_free() -> None:
    near = msgspec.structs.replace(LIDAR, range_min=1.3, range_max=2.1)
    scan = scan_of(revolution_of(720), near, BODY, "laser")
    true = room(scan.angles.astype(float))
    assert np.isnan(scan.ranges[true < 1.28]).all()
    assert np.isinf(scan.ranges[true > 2.15]).all()


def test_a_lidar_of_part_of_a_revolution_leaves_out_the_rest() -> None:
    part = msgspec.structs.replace(LIDAR, field_of_view=math.pi, beams=181)
    scan = scan_of(revolution_of(720), part, OwnBody(part, ROBOT.footprint), "laser")
    assert scan.angles[0] == pytest.approx(-math.pi / 2) and scan.angles[-1] == pytest.approx(math.pi / 2)
    assert scan.ranges[90] == pytest.approx(2.0, abs=0.01)


def test_angles_that_step_back_make_no_short_revolution() -> None:
    clockwise = np.concatenate([np.linspace(0.0, 2.0 * math.pi, 100, endpoint=False)] * 3)
    clockwise[[100, 101, 200, 201]] -= 0.1  # the correction of near samples
    bearings = bearings_of(clockwise, math.pi)
    samples = Samples(bearings, np.ones(300), np.arange(300))
    revolutions = RevolutionAssembler().push(samples)
    assert [round(len(revolution.ranges), -1) for revolution in revolutions] == [100]


def test_an_interrupted_revolution_is_discarded() -> None:
    wire = Wire("ld19")
    wire.run(1)
    for _ in range(10):
        wire.receive(wire.frame())
    wire.revolutions.clear()
    assert 400 < len(wire.run(1)[0].ranges) < 500
