"""A drive of a map: what is kept of it, and what is refused."""

from __future__ import annotations

import io
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.errors import ScanError
from chefbot.maths.se2 import SE2
from chefbot.slam.graph import GraphSlamParams
from chefbot.slam.offline import OfflineMapper
from chefbot.slam.params import GmappingParams
from chefbot.slam.recorded_scan import RecordedScan
from chefbot.slam.session import Session

LASER = SE2(0.1, 0.0, 0.0)


def scans(count: int = 12) -> list[RecordedScan]:
    """A robot that turns in a room; every second scan has another number of beams."""
    found = []
    for i in range(count):
        odom, beams = SE2(0.1 * i, 0.0, 0.3 * i), 90 + i % 2
        angles = np.linspace(-1.5, 1.5, beams).astype(np.float32)
        ranges = (2.0 + 0.3 * np.sin(3.0 * (angles + odom.yaw))).astype(np.float32)
        found.append(RecordedScan(float(i), angles, ranges, odom @ LASER, odom))
    return found


def session() -> Session:
    recorded = scans()
    return Session.of(recorded, [i % 3 != 1 for i in range(len(recorded))], 8.0, SE2(1.0, 2.0, 0.5))


def test_a_session_is_the_same_after_it_was_stored() -> None:
    before = session()
    after = Session.from_bytes(before.to_bytes())
    assert after.to_bytes() == before.to_bytes()
    for kept, recorded, used in zip(after.scans(), scans(), after.used.tolist(), strict=True):
        assert (kept.stamp, kept.odom) == (recorded.stamp, recorded.odom)
        assert kept.laser.distance(recorded.laser) < 1e-12
        assert kept.ranges.tolist() == (recorded.ranges.tolist() if used else [])


@pytest.mark.parametrize("params", [GmappingParams(particles=3), GraphSlamParams()])
def test_a_map_that_is_built_again_is_the_same(params: GmappingParams | GraphSlamParams) -> None:
    first = OfflineMapper(params, LASER)
    first.map_drive(scans(), 8.0)
    again = OfflineMapper(params, LASER)
    again.repeat(Session.from_bytes(first.sessions[0].to_bytes()))
    one, other = first.result(None), again.result(None)
    assert one.poses == other.poses and (one.grid.cells == other.grid.cells).all()


@pytest.mark.parametrize("count", [1, 3, 8, 20])
def test_only_the_first_used_scans_are_kept(count: int) -> None:
    before = session()
    after = before.with_used(count)
    assert after.used.sum() == min(count, before.used.sum()) and len(after.stamps) == len(before.stamps)
    kept = [scan for scan in after.scans() if len(scan.ranges)]
    for one, other in zip(kept, (scan for scan in before.scans() if len(scan.ranges)), strict=False):
        assert one.stamp == other.stamp and one.ranges.tolist() == other.ranges.tolist()


Change = Callable[[dict[str, np.ndarray]], object]


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays: arrays.pop("laser"),
        lambda arrays: arrays.update(stamps=arrays["stamps"][:-1]),
        lambda arrays: arrays.update(beams=arrays["beams"] + 1),
        lambda arrays: arrays.update(odometry=arrays["odometry"] * np.nan),
        lambda arrays: arrays.update(used=arrays["used"].astype(np.float64)),
        lambda arrays: arrays.update(ranges=arrays["ranges"].astype(object)),
        lambda arrays: arrays.update(used=np.zeros_like(arrays["used"])),
    ],
)
def test_a_session_that_does_not_fit_together_is_refused(change: Change) -> None:
    with np.load(io.BytesIO(session().to_bytes())) as archive:
        arrays = dict(archive)
    change(arrays)
    file = io.BytesIO()
    np.savez(file, allow_pickle=True, **arrays)  # type: ignore[arg-type]
    with pytest.raises(ScanError):
        Session.from_bytes(file.getvalue())


@given(st.binary(max_size=300), st.integers(0, 4000), st.integers(0, 3))
def test_damaged_bytes_are_refused_or_change_nothing(noise: bytes, place: int, kind: int) -> None:
    data = bytearray(session().to_bytes())
    at = place % len(data)
    if kind == 0:
        data = data[:at]
    elif kind == 1:
        data[at : at + len(noise)] = noise
    elif kind == 2:
        data = bytearray(noise)
    try:
        Session.from_bytes(bytes(data))
    except ScanError as error:
        assert str(error)


def test_parameters_are_stored_as_json() -> None:
    params = GmappingParams(particles=7, seed=5)
    assert msgspec.json.decode(msgspec.json.encode(params), type=GmappingParams) == params
