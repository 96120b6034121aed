"""The figures by which a sensor counts as frozen, noisy, blind, late or ahead, each tried on both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.safety.sensor_freshness import ObstacleSensorMonitor, SensorView

MS = 1_000_000
HERE = SE2(1.0, 2.0, 3.0)
Floats = NDArray[np.float64]


def view(stamp_ns: int, ranges: Floats) -> SensorView:
    met = np.isfinite(ranges) & (ranges > 0.0)
    return SensorView(stamp_ns, ranges.astype(np.float32)[:, None], met, met, ~(ranges > 0.0), False, "laser")


class Lidar:
    """A monitored lidar of 10 Hz whose messages arrive and are marked at once."""

    def __init__(self) -> None:
        self.watch, self.now_ns = ObstacleSensorMonitor("lidar", 0.1), 0

    def send(self, ranges: Floats, pose: SE2 | None = HERE) -> None:
        self.now_ns += 100 * MS
        self.watch.process_view(view(self.now_ns, ranges), self.now_ns, pose)
        self.watch.note_marked(self.now_ns)

    def repeat(self, ranges: Floats, pose: SE2 | None = HERE) -> str:
        """Send the same ranges for a second, and return the fault then."""
        for _ in range(10):
            self.send(ranges, pose)
        return self.watch.fault(self.now_ns, pose)


def walls(beams: int = 100) -> Floats:
    return np.linspace(1.0, 2.0, beams)


def is_noisy_after(messages: list[Floats], poses: list[SE2 | None] | None = None) -> bool:
    """Return whether equal ranges at standstill count as frozen after some messages, as of a sensor with noise."""
    lidar, pose = Lidar(), None
    for ranges, pose in zip(messages, poses or [HERE] * len(messages), strict=True):
        lidar.send(ranges, pose)
    return "frozen" in lidar.repeat(messages[-1], pose or HERE)


def alternating(count: int, change: Floats) -> list[Floats]:
    """Return ranges that change in turns, `count` times."""
    return [walls(len(change)) + change * (k % 2) for k in range(count + 1)]


@pytest.mark.parametrize(("count", "noisy"), [(4, False), (5, True)])
def test_five_changes_in_a_row_are_noise(count: int, noisy: bool) -> None:
    assert is_noisy_after(alternating(count, np.full(100, 0.01))) == noisy
    four = alternating(4, np.full(100, 0.01))
    assert not is_noisy_after([*four, walls(), *four])


@pytest.mark.parametrize(("change", "noisy"), [(0.00019, False), (0.00021, True), (-0.00021, True)])
def test_a_fifth_of_a_millimetre_is_noise(change: float, noisy: bool) -> None:
    assert is_noisy_after(alternating(8, np.full(100, change))) == noisy


@pytest.mark.parametrize(("directions", "noisy"), [(50, False), (51, True)])
def test_noise_is_in_more_than_half_of_the_directions(directions: int, noisy: bool) -> None:
    """Who walks by changes fewer."""
    assert is_noisy_after(alternating(8, 0.01 * (np.arange(100) < directions))) == noisy


@pytest.mark.parametrize(("beams", "noisy"), [(9, False), (10, True)])
def test_ten_directions_are_needed_to_recognize_noise(beams: int, noisy: bool) -> None:
    assert is_noisy_after(alternating(8, np.full(beams, 0.01))) == noisy
    hidden = np.where(np.arange(100) < beams, walls(), np.nan)
    assert is_noisy_after([hidden + 0.01 * (k % 2) for k in range(9)]) == noisy


@pytest.mark.parametrize(("step", "noisy"), [(0.0004, True), (0.0006, False)])
def test_only_at_standstill_changes_are_noise(step: float, noisy: bool) -> None:
    """Less than half a millimetre, or half a milliradian, between two messages."""
    messages = alternating(8, np.full(100, 0.01))
    driving: list[SE2 | None] = [SE2(1.0 + step * k, 2.0, 3.0) for k in range(9)]
    turning: list[SE2 | None] = [SE2(1.0, 2.0, 3.1415 + step * k) for k in range(9)]
    for poses in (driving, turning):
        assert is_noisy_after(messages, poses) == noisy
    assert not is_noisy_after(messages, [None] * 9), "nobody knows whether it stands"
    assert not is_noisy_after(messages, [HERE, None] * 4 + [HERE])


def test_other_numbers_of_beams_are_not_noise() -> None:
    """A lidar may send a beam more or less in each turn; such scans cannot be compared."""
    assert not is_noisy_after([walls(100 + k % 2) for k in range(9)])


@pytest.mark.parametrize(("metres", "radians", "frozen"), [
    (0.019, 0.0, False), (0.021, 0.0, True), (0.0, 0.029, False), (0.0, 0.031, True), (0.0, -0.031, True),
])  # fmt: skip
def test_after_two_centimetres_walls_look_different(metres: float, radians: float, frozen: bool) -> None:
    """A sensor without noise repeats itself while the robot stands; when it has moved, equal data are frozen."""
    lidar = Lidar()
    lidar.repeat(walls())
    moved = SE2(HERE.x, HERE.y + metres, HERE.yaw + radians)
    assert ("frozen" in lidar.repeat(walls(), moved)) == frozen
    assert "frozen" not in lidar.repeat(walls(), None), "without odometry nobody knows"


@pytest.mark.parametrize(("metres", "radians"), [(0.02, 0.0), (0.0, 0.03)])
def test_exactly_two_centimetres_are_not_motion(metres: float, radians: float) -> None:
    origin, lidar = SE2(0.0, 0.0, 0.0), Lidar()
    lidar.repeat(walls(), origin)
    assert "frozen" not in lidar.repeat(walls(), SE2(metres, 0.0, radians))


def test_a_small_turn_across_the_back_is_not_motion() -> None:
    """Where the heading jumps from pi to -pi."""
    lidar = Lidar()
    lidar.repeat(walls(), SE2(0.0, 0.0, math.pi - 0.001))
    assert "frozen" not in lidar.repeat(walls(), SE2(0.0, 0.0, -math.pi + 0.001))


def test_a_frozen_scan_need_not_see_on_all_sides() -> None:
    lidar, ranges = Lidar(), np.where(np.arange(100) < 40, walls(), np.inf)
    lidar.repeat(ranges)
    assert "frozen" in lidar.repeat(ranges, SE2(2.0, 2.0, 3.0))


def test_directions_that_come_and_go_are_not_noise() -> None:
    """At the end of its range a lidar without noise may measure in every other scan."""
    far = np.arange(100) < 60
    assert not is_noisy_after([np.where(far & (k % 2 == 0), np.inf, walls()) for k in range(9)])


def test_noise_in_one_of_several_measurements_is_noise() -> None:
    """A camera's ranges are noisy although the floor before them always begins at the same place."""
    watch, met = ObstacleSensorMonitor("depth camera", 0.1), np.ones(100, np.bool_)
    for k in range(20):
        data = np.column_stack([walls() + 0.01 * (k % 2) * (k < 10), np.full(100, 0.7)]).astype(np.float32)
        watch.process_view(
            SensorView(100 * k * MS, data, met, met, ~met, False, "camera"), 100 * k * MS, HERE
        )
        watch.note_marked(100 * k * MS)
    assert "frozen" in watch.fault(1900 * MS, HERE)


def test_what_sees_nothing_does_not_freeze() -> None:
    """An empty hall looks the same from everywhere, also to a sensor that was noisy near walls."""
    lidar = Lidar()
    for ranges in alternating(8, np.full(100, 0.01)):
        lidar.send(ranges)
    nothing = np.full(100, np.inf)
    assert "frozen" not in lidar.repeat(nothing) and "frozen" not in lidar.repeat(nothing, SE2(9.0, 9.0, 0.0))


@pytest.mark.parametrize(("stamp_ms", "expected"), [
    (100, ""), (101, "stamped in the future"), (-300, ""), (-301, "come late: they are more than 0.3 s old"),
])  # fmt: skip
def test_stamps_may_differ_by_a_tenth_of_a_second(stamp_ms: int, expected: str) -> None:
    watch, now_ns = ObstacleSensorMonitor("lidar", 0.1), 10_000 * MS
    for k in range(10):
        stamp = now_ns + (stamp_ms + k - 9) * MS
        watch.process_view(view(stamp, walls() + 0.001 * k), now_ns, HERE)
        watch.note_marked(stamp)
    assert expected in watch.fault(now_ns, HERE) and bool(watch.fault(now_ns, HERE)) == bool(expected)


def test_five_messages_are_needed_from_the_beginning() -> None:
    """Also if nobody has queried it before, and although the first ones are not placed yet."""
    watch, now_ns = ObstacleSensorMonitor("lidar", 0.1), 10_000 * MS
    for k in range(5):
        assert watch.fault(now_ns, HERE) == "The lidar has not sent anything yet."
        watch.process_view(view(now_ns + k * MS, walls() + 0.001 * k), now_ns + k * MS, HERE)
    assert watch.fault(now_ns + 4 * MS, HERE) == ""
    unqueried = ObstacleSensorMonitor("lidar", 0.1)
    for k in range(4):
        unqueried.process_view(view(now_ns + k * MS, walls()), now_ns, HERE)
    assert unqueried.fault(now_ns, HERE) == "The lidar has not sent anything yet."


@pytest.mark.parametrize(
    ("gap_ms", "expected"), [(300, ""), (301, "sends too seldom: two messages lay more than 0.3 s")]
)
def test_messages_may_lie_three_periods_apart(gap_ms: int, expected: str) -> None:
    lidar = Lidar()
    lidar.repeat(walls())
    lidar.now_ns += (gap_ms - 100) * MS
    assert lidar.watch.fault(lidar.now_ns, HERE) == ""
    lidar.send(walls() + 0.001)
    assert expected in lidar.watch.fault(lidar.now_ns, HERE) and bool(
        lidar.watch.fault(lidar.now_ns, HERE)
    ) == bool(expected)


@pytest.mark.parametrize(("age_ms", "expected"), [(300, ""), (301, "has sent nothing for more than 0.3 s")])
def test_silence_begins_after_three_periods(age_ms: int, expected: str) -> None:
    lidar = Lidar()
    lidar.repeat(walls())
    fault = lidar.watch.fault(lidar.now_ns + age_ms * MS, HERE)
    assert expected in fault and bool(fault) == bool(expected)


def test_it_has_sent_from_the_first_message_on() -> None:
    lidar = Lidar()
    assert not lidar.watch.has_sent and lidar.watch.blind() is False
    lidar.send(walls())
    assert lidar.watch.has_sent


def test_who_sends_no_directions_is_blind() -> None:
    lidar = Lidar()
    lidar.send(walls(0))
    assert lidar.watch.blind() and lidar.watch.blind(np.zeros(0, np.bool_))


@pytest.mark.parametrize(("beams", "mute"), [(8, 1), (40, 5)])
def test_exactly_half_of_a_quarter_is_not_blind(beams: int, mute: int) -> None:
    lidar, ranges = Lidar(), walls(beams)
    ranges[:mute] = np.nan
    lidar.send(ranges)
    assert not lidar.watch.blind()


def test_walls_do_not_vanish_but_far_ones_may() -> None:
    """From near walls on all sides to nothing is a fault; from a hall whose walls are far it is not."""
    for last, blind in ((True, True), (False, False)):
        watch, met = ObstacleSensorMonitor("lidar", 0.1), np.arange(100) < 50
        for k, (hit, near) in enumerate([(met, True), (met, last), (met & False, False)]):
            data = np.where(hit, 3.0, np.inf)[:, None].astype(np.float32)
            watch.process_view(
                SensorView(100 * k * MS, data, hit, hit, hit & False, near, "laser"), 100 * k * MS, HERE
            )
        assert watch.blind() == blind


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_few_directions_are_judged_each(count: int) -> None:
    lidar = Lidar()
    lidar.send(walls(count))
    assert not lidar.watch.blind()
    lidar.send(np.append(walls(count - 1), np.nan))
    assert lidar.watch.blind() and not lidar.watch.blind(np.arange(count) == count - 1)


@pytest.mark.parametrize(("mute", "blind"), [(12, False), (13, True)])
def test_half_of_a_quarter_without_data_is_blind(mute: int, blind: bool) -> None:
    for quarter in range(4):
        lidar, ranges = Lidar(), walls()
        ranges[25 * quarter : 25 * quarter + mute] = np.nan
        lidar.send(ranges)
        assert lidar.watch.blind() == blind


def without(directions: slice) -> Floats:
    """Return walls with no data in these of 100 directions."""
    ranges = walls()
    ranges[directions] = np.nan
    return ranges


@pytest.mark.parametrize(("mute", "hidden"), [(6, False), (7, True), (100, True)])
def test_a_sixteenth_without_data_from_an_edge_is_hidden(mute: int, hidden: bool) -> None:
    for directions in (slice(0, mute), slice(100 - mute, 100)):
        lidar = Lidar()
        assert not lidar.watch.hidden_at_edge(), "nothing was sent"
        lidar.send(walls())
        lidar.send(without(directions))
        assert lidar.watch.hidden_at_edge() == hidden
        explained = np.zeros(100, np.bool_)
        explained[directions] = True
        assert not lidar.watch.hidden_at_edge(explained)
        lidar.send(walls())
        assert not lidar.watch.hidden_at_edge()
        lidar.send(np.zeros(0))
        assert not lidar.watch.hidden_at_edge()


def test_what_a_camera_never_measures_at_an_edge_is_not_hidden() -> None:
    lidar = Lidar()
    lidar.send(without(slice(0, 10)))
    for mute, hidden in ((10, False), (16, False), (17, True)):
        lidar.send(without(slice(0, mute)))
        assert lidar.watch.hidden_at_edge() == hidden
    lidar.send(without(slice(93, 100)))
    assert lidar.watch.hidden_at_edge(), "the other edge has no such band"


def test_missing_data_within_the_view_are_not_hidden_at_its_edge() -> None:
    lidar = Lidar()
    lidar.send(walls())
    lidar.send(without(slice(1, 30)))
    assert not lidar.watch.hidden_at_edge()


def test_transforms_have_their_time_again_after_a_gap() -> None:
    """The first data after a gap are not in the costmap yet: that is not a missing transform."""
    lidar = Lidar()
    lidar.repeat(walls())
    lidar.now_ns += 5000 * MS
    faults = []
    for number in range(5):
        lidar.watch.process_view(view(lidar.now_ns, walls() + 0.01 * number), lidar.now_ns, HERE)
        faults.append(lidar.watch.fault(lidar.now_ns, HERE))
        lidar.now_ns += 100 * MS
    assert all("too seldom" in fault for fault in faults[:4]), faults
    assert "no transform" in faults[4], "no data are marked for longer than the limit"


def test_measurable_directions_are_without_bands_at_the_edges() -> None:
    lidar = Lidar()
    assert lidar.watch.measurable == slice(0, 0), "nothing was sent"
    lidar.send(without(slice(0, 10)))
    assert lidar.watch.measurable == slice(10, 100)
    lidar.send(without(slice(80, 100)))
    assert lidar.watch.measurable == slice(0, 100), "each band was measured once"
    lidar.send(np.zeros(0))
    assert lidar.watch.measurable == slice(0, 0)
