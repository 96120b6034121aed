"""What every lidar driver keeps: ranges as measured, from bytes split anywhere, and none that is wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.lidar.models import LIDARS
from chefbot.lidar.revolutions import Samples
from chefbot.lidar.session import LidarError

from .wires import OPEN, Wire, room

DRIVERS = list(LIDARS)


def assert_true_ranges(revolution: Samples, tolerance: float = 0.012) -> None:
    """Each range is that of the room in a direction that quantization allows."""
    lowest = np.min([room(revolution.bearings + d) for d in (-0.012, 0.0, 0.012)], axis=0)
    highest = np.max([room(revolution.bearings + d) for d in (-0.012, 0.0, 0.012)], axis=0)
    found = np.isfinite(revolution.ranges)
    assert (revolution.ranges >= lowest - tolerance)[found].all()
    assert (revolution.ranges <= highest + tolerance)[found].all()
    assert (np.abs(revolution.bearings[~found]) > math.pi - OPEN - 0.16).all()


@pytest.mark.parametrize("driver", DRIVERS)
def test_whole_revolutions_have_the_ranges_of_the_room(driver: str) -> None:
    wire = Wire(driver)
    wire.start()
    for revolution in wire.run(3):
        assert_true_ranges(revolution)
        assert (
            np.diff(np.sort(revolution.bearings)).max() < 0.16
        )  # triangulating ones have a gap where ranges jump
        assert len(revolution.bearings) == pytest.approx(
            wire.lidar.sample_rate / wire.lidar.revolution_rate, rel=0.15
        )


@pytest.mark.parametrize("driver", DRIVERS)
def test_samples_have_the_times_at_which_they_were_measured(driver: str) -> None:
    wire = Wire(driver)
    wire.start()
    revolution = wire.run(2)[-1]
    period_ns = 1e9 / wire.lidar.revolution_rate
    # bearing falls by a revolution in the period; where the revolution is known to be now anchors it
    slope, _ = np.polyfit(
        revolution.bearings, (revolution.times_ns - revolution.times_ns[0]).astype(float), 1
    )
    assert -slope * 2.0 * math.pi == pytest.approx(period_ns, rel=0.05)
    assert 0.0 <= (wire.now_ns - revolution.times_ns[-1]) / 1e9 < 0.03


@pytest.mark.parametrize("driver", ["ld19", "rplidar_a1", "rplidar_c1", "ydlidar_x4", "ydlidar_g2"])
@given(data=st.data())
@settings(max_examples=10, deadline=None)
def test_bytes_can_be_split_anywhere(driver: str, data: st.DataObject) -> None:
    wire, whole = Wire(driver), Wire(driver)
    for one in (wire, whole):
        one.start()
    stream = b"".join(whole.frame() for _ in range(60))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=30)))
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    split = [part for piece in pieces for part in wire.session.receive_data(piece, 10**10)]
    joined = whole.session.receive_data(stream, 10**10)
    assert np.concatenate([part.ranges for part in split]) == pytest.approx(
        np.concatenate([part.ranges for part in joined])
    )
    assert wire.session.damaged == 0


def damaged(stream: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes of which some are changed, lost, or new."""
    out = bytearray(stream)
    for _ in range(rng.integers(1, 6)):
        at = int(rng.integers(len(out)))
        kind = rng.integers(3)
        if kind == 0:
            out[at] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del out[at : at + int(rng.integers(1, 40))]
        else:
            out[at:at] = rng.bytes(int(rng.integers(1, 40)))
    return bytes(out)


@pytest.mark.rotated
@pytest.mark.parametrize("driver", DRIVERS)
@pytest.mark.slow
def test_damaged_bytes_never_make_a_wrong_range(driver: str) -> None:
    wrong = total = 0
    for seed in range(8):
        wire, rng = Wire(driver), np.random.default_rng(seed)
        wire.start()
        per_revolution = math.ceil(wire.lidar.sample_rate / wire.lidar.revolution_rate / wire.lidar.samples)
        wire.run(1)
        stream = b"".join(wire.frame() for _ in range(per_revolution))
        try:
            parts = wire.session.receive_data(damaged(stream, rng), wire.now_ns)
        except LidarError:
            continue
        for part in parts:
            found = np.isfinite(part.ranges)
            near = np.stack([room(part.bearings + d) for d in np.linspace(-0.06, 0.06, 13)])
            ok = (part.ranges >= near.min(axis=0) - 0.02) & (part.ranges <= near.max(axis=0) + 0.02)
            nothing = np.abs(part.bearings) > math.pi - OPEN - 0.2
            wrong += int((found & ~ok).sum() + (~found & ~nothing).sum())
            total += len(found)
        # and it is back within a revolution
        after = [
            part
            for _ in range(per_revolution)
            for part in wire.session.receive_data(wire.frame(), wire.now_ns)
        ]
        assert sum(len(part.ranges) for part in after) > 0.5 * per_revolution * wire.lidar.samples
    assert wrong == 0 and total > 0


@pytest.mark.parametrize("driver", DRIVERS)
@given(noise=st.binary(max_size=3000))
@settings(max_examples=15, deadline=None)
def test_noise_is_not_a_range_and_ends_nothing(driver: str, noise: bytes) -> None:
    wire = Wire(driver)
    wire.start()
    try:
        parts = wire.session.receive_data(noise, wire.now_ns)
    except LidarError:
        return
    assert sum(len(part.ranges) for part in parts) <= 48


def test_nothing_in_range_is_not_an_obstacle() -> None:
    wire = Wire("ld19")
    revolution = wire.run(2)[-1]
    behind = np.abs(np.abs(revolution.bearings) - math.pi) < OPEN - 0.05
    assert np.isinf(revolution.ranges[behind]).all() and np.isfinite(revolution.ranges[~behind]).any()
