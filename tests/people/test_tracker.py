"""Tests that people are tracked with their numbers, and that nothing else is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.people.scene import BEAMS, ORIGIN, PERIOD, Walk, legs, observe, ranges_of, scan_of

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import IDENTITY, SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan
from chefbot.msgs.std_msgs import Header
from chefbot.people.observation import Observation, observe_obstacles, observe_scan
from chefbot.people.params import PeopleTrackerParams
from chefbot.people.tracker import MAX_LAG, RESET_COUNT, PeopleTracker

CHAIR = [(x, y, 0.02) for x in (2.0, 2.4) for y in (-0.2, 0.2)]


def tracker(**changes: float) -> PeopleTracker:
    return PeopleTracker(PeopleTrackerParams(**changes))


@pytest.mark.parametrize("seed", range(1, 20, 2))
def test_somebody_who_walks_is_tracked_with_velocity(seed: int) -> None:
    walk = Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0)], seed)
    walk.run(3.0)
    (person,) = walk.tracker.people
    x, y = walk.at(0)
    assert person.state.distance(x - 0.8 * PERIOD, y) < 0.1
    assert math.hypot(person.state.vx - 0.8, person.state.vy) < 0.25
    assert person.visible and not person.standing
    assert person.confidence > 0.9


@pytest.mark.parametrize("seed", range(1, 20, 2))
def test_furniture_and_walls_are_nobody(seed: int) -> None:
    walk = Walk(tracker(), [], seed)
    walk.run(6.0, CHAIR)
    assert walk.tracker.people == []


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.5, 2.0])
def test_the_bare_walls_of_a_hall_are_nobody(scale: float) -> None:
    tracker, rng = PeopleTracker(PeopleTrackerParams()), np.random.default_rng(1)
    for k in range(100):
        tracker.update(observe_scan(scan_of(scale * ranges_of([], rng)), ORIGIN), PERIOD * k)
    assert tracker.tracks == []


def test_legs_on_an_obstacle_of_the_map_are_nobody() -> None:
    cells = np.zeros((200, 200), np.int8)
    cells[95:105, 135:145] = 100  # around (2, 0)
    for known in (False, True):
        tracks = tracker()
        if known:
            tracks.set_map(Grid(cells, 0.05, -5.0, -5.0))
        for k in range(60):
            tracks.update(observe(legs(2.0, 0.0, 0.0)), 10.0 + PERIOD * k, IDENTITY)
        assert len(tracks.people) == (0 if known else 1)


def test_somebody_who_stops_stands_and_keeps_the_number() -> None:
    walk = Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0)])
    walk.run(2.5)
    number = walk.tracker.people[0].id
    x, y = walk.at(0)
    walk.people = [(x, y, 0.0, 1e-6)]
    walk.time = 1000.0 + (walk.time - 1000.0)
    for _ in range(60):
        walk.tracker.update(observe(legs(x, y, 0.5 * math.pi)), walk.time)
        walk.time += PERIOD
    (person,) = walk.tracker.people
    assert person.id == number
    assert person.standing
    assert person.state.speed < 0.2


def test_two_who_cross_keep_their_numbers() -> None:
    walk = Walk(tracker(), [(-2.0, 1.2, 0.7, 0.0), (2.0, 2.4, -0.7, 0.0)])
    walk.run(1.5)
    before = {person.id: person.state.y for person in walk.tracker.people}
    walk.run(3.0)
    after = {person.id: person.state.y for person in walk.tracker.people}
    assert len(before) == 2
    assert after == pytest.approx(before, abs=0.2)


def test_behind_an_obstacle_only_the_doubt_grows() -> None:
    walk = Walk(tracker(), [(-2.0, 2.5, 0.8, 0.0)])
    walk.run(2.4)
    (before,) = (person.state.deviation for person in walk.tracker.people)
    number = walk.tracker.people[0].id
    screen = [(0.1 * k, 1.0, 0.06) for k in range(-8, 16)]
    walk.run(1.2, screen)
    (hidden,) = walk.tracker.people
    assert hidden.id == number
    assert hidden.state.deviation > 2.0 * before
    assert not hidden.visible
    assert hidden.last_seen.time < walk.time - 1.0


def test_somebody_seen_gone_is_gone_within_two_seconds() -> None:
    walk = Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0)])
    walk.run(3.0)
    assert len(walk.tracker.people) == 1
    walk.people = []
    walk.run(2.0)
    assert walk.tracker.people == []


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-3, 3), st.floats(0.6, 3), st.floats(-1, 1), st.floats(-1, 1)), max_size=4)
)
@pytest.mark.slow
def test_numbers_are_never_used_again(people: list[tuple[float, float, float, float]]) -> None:
    walk, seen, gone = Walk(tracker(), list(people)), set[int](), set[int]()
    for _ in range(8):
        walk.run(1.0)
        now = {person.id for person in walk.tracker.people}
        assert not now & gone
        assert all(number > max(seen, default=0) for number in now - seen)
        seen |= now
        gone |= seen - now
        walk.people = walk.people[1:] if len(gone) % 2 else list(people)
    for track in walk.tracker.tracks:
        assert np.linalg.eigvalsh(track.state.covariance()).min() > 0.0


def test_the_same_scans_give_the_same_tracks() -> None:
    walks = [Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0), (2.0, -1.0, 0.0, 0.5)]) for _ in range(2)]
    for walk in walks:
        walk.run(3.0, CHAIR)
    assert walks[0].tracker.tracks == walks[1].tracker.tracks


def test_a_lidar_that_turns_clockwise_sees_the_same() -> None:
    ranges = ranges_of(legs(1.5, 0.5, 1.0))
    usual = observe_scan(scan_of(ranges), ORIGIN)
    step = 2.0 * math.pi / BEAMS
    scan = scan_of(ranges[::-1])
    clockwise = type(scan)(
        scan.header, math.pi - step, -math.pi, -step, 0.0, 0.0, scan.range_min, scan.range_max, scan.ranges
    )
    other = observe_scan(clockwise, ORIGIN)
    assert other.is_usable
    assert np.allclose(other.points(), usual.points(), atol=1e-5)


def image_of(bottom: float, top: float, bearing: float) -> Observation:
    """Return what a depth camera sees of a thing 2 m away that spans these heights, m."""
    n = 160
    angles = -0.5 + np.arange(n) / n
    ranges = np.where(np.abs(angles - bearing) < 0.08, 2.0, np.inf).astype(np.float32)
    clear_from, clear_to = np.full(n, 0.6, np.float32), np.full(n, 4.0, np.float32)
    heights = [np.full(n, value, np.float32) for value in (bottom, top)]
    return observe_obstacles(
        ObstacleScan(Header(), -0.5, 1.0 / n, 8.0, ranges, clear_from, clear_to, *heights), ORIGIN
    )


@pytest.mark.parametrize(("bottom", "people"), [(0.05, 1), (0.45, 0)])
def test_legs_in_depth_images_are_somebody_table_tops_nobody(bottom: float, people: int) -> None:
    tracks = tracker()
    for k in range(30):
        tracks.update(image_of(bottom, 0.55, 0.4 - 0.02 * k), 10.0 + PERIOD * k)
    assert len(tracks.people) == people


def many_people(count: int, shift: float) -> list[tuple[float, float, float]]:
    """Return the legs of many people on rings around the robot."""
    turn = [2.4 * k + shift for k in range(count)]
    reach = [1.0 + 2.7 * (k / count) for k in range(count)]
    return [
        leg for a, r in zip(turn, reach, strict=True) for leg in legs(r * math.cos(a), r * math.sin(a), a)
    ]


@pytest.mark.parametrize("count", [30, 200])
def test_of_a_crowd_a_bounded_number_is_tracked(count: int) -> None:
    tracks = tracker(max_people=5)
    warnings = set[str]()
    for k in range(30):
        assert tracks.update(observe(many_people(count, 0.01 * k)), 10.0 + PERIOD * k)
        assert len(tracks.tracks) <= 5
        warnings.add(tracks.take_warning())
    assert any("More than 5 people" in warning for warning in warnings)
    assert tracks.take_warning() == ""


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, -math.inf])
def test_scans_without_any_return_are_taken(value: float) -> None:
    walk = Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0)])
    walk.run(2.5)
    scan = scan_of(np.full(BEAMS, value, np.float32))
    for _ in range(30):
        assert walk.tracker.update(observe_scan(scan, ORIGIN), walk.time)
        walk.time += PERIOD
    seen_free = value == math.inf
    assert len(walk.tracker.people) == (0 if seen_free else 1)


@pytest.mark.parametrize(
    "sensor", [SE2(math.nan, 0.0, 0.0), SE2(0.0, math.inf, 0.0), SE2(0.0, 0.0, -math.inf)]
)
def test_scans_from_no_place_are_ignored(sensor: SE2) -> None:
    tracks = tracker()
    assert not tracks.update(observe_scan(scan_of(ranges_of([])), sensor), 1.0)
    assert not tracks.update(observe([]), math.nan)
    assert not tracks.update(observe_scan(type(scan_of(ranges_of([])))(), ORIGIN), 1.0)


def test_old_scans_are_ignored_until_the_clock_was_set_back() -> None:
    walk = Walk(tracker(), [(-2.0, 1.5, 0.8, 0.0)])
    walk.run(2.5)
    before = walk.tracker.people[0]
    state, old = before.state, walk.time - 100.0
    for _ in range(RESET_COUNT - 1):
        assert not walk.tracker.update(observe([]), old)
    assert walk.tracker.people[0].state == state
    assert "older" in walk.tracker.take_warning()
    walk.tracker.update(observe([]), old)
    assert walk.tracker.people == []
    assert walk.tracker.update(observe([]), old + MAX_LAG)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 400))
def test_any_ranges_are_taken(seed: int, count: int) -> None:
    rng, tracks = np.random.default_rng(seed), tracker(max_people=10)
    for k in range(5):
        ranges = rng.choice([0.0, -1.0, np.nan, np.inf, 0.2, 1.0, 2.0, 11.9, 1e30], count).astype(np.float32)
        scan = scan_of(ranges)
        tracks.update(
            observe_scan(scan, SE2(*rng.normal(0.0, 100.0, 3))), 5.0 + PERIOD * k, SE2(1e6, -1e6, 3.0)
        )
        for track in tracks.tracks:
            assert np.linalg.eigvalsh(track.state.covariance()).min() > 0.0
