"""Where on a map a recording begins: the scan at which it is found, or a sentence with advice."""

from __future__ import annotations

import numpy as np
import pytest
from tests.support.pillar_room import ANGLES, circle, mapped, ranges_at

from chefbot.cli.map.start_search import MAX_UPDATES, find_start
from chefbot.errors import UserError
from chefbot.maths.grid import OCCUPIED_THRESHOLD, Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.slam.recorded_scan import RecordedScan

BEAMS = ANGLES.astype(np.float32)
RANGE_MAX = 12.0


@pytest.fixture(scope="module")
def room() -> Grid:
    return mapped()


def drive(start: SE2, turns: float) -> list[RecordedScan]:
    """Return the scans of a drive on a circle that begins at a pose of the room."""
    poses = circle(turns)
    return [RecordedScan(0.1 * i, BEAMS, ranges_at(start @ odom), odom, odom) for i, odom in enumerate(poses)]


def test_the_place_and_the_scan_are_found(room: Grid) -> None:
    start, progress = SE2(1.5, 0.3, 2.0), []
    scans = drive(start, 2.0)
    found = find_start(room, scans, IDENTITY, RANGE_MAX, lambda i, n: progress.append((i, n)))
    assert found.pose.distance(start @ scans[found.scan].odom) < 0.15
    assert progress == [(i, len(scans)) for i in range(found.scan + 1)]


def test_a_recording_that_shows_nothing_is_refused_with_advice(room: Grid) -> None:
    with pytest.raises(UserError, match=r"first \d+ scans of the new drive .* begins; name it$"):
        find_start(room, drive(SE2(1.5, 0.3, 2.0), 0.05), IDENTITY, RANGE_MAX, advice="; name it")


def test_a_recording_of_another_place_is_given_up(room: Grid) -> None:
    blank = np.full(len(BEAMS), 0.7, np.float32)
    scans = [
        RecordedScan(0.1 * i, BEAMS, blank, SE2(0.2 * i, 0.0, 0.0), SE2(0.2 * i, 0.0, 0.0))
        for i in range(MAX_UPDATES + 200)
    ]
    seen: list[int] = []
    with pytest.raises(UserError, match=f"first {MAX_UPDATES} scans"):
        find_start(room, scans, IDENTITY, RANGE_MAX, lambda i, _: seen.append(i))
    assert len(seen) < len(scans)


def test_a_robot_is_found_on_mapped_floor_only(room: Grid) -> None:
    """Walls alone fit its scans as well, but somebody has to have driven on the floor between them."""
    cells = np.where(room.cells >= OCCUPIED_THRESHOLD, room.cells, -1).astype(np.int8)
    cells[:12] = room.cells[:12]  # a strip along one wall stays free
    strip = Grid(cells, room.resolution, room.origin_x, room.origin_y)
    with pytest.raises(UserError, match="do not show where on the map it begins"):
        find_start(strip, drive(SE2(1.5, 0.3, 2.0), 2.0), IDENTITY, RANGE_MAX)
