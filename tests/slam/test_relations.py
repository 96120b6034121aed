"""Relation errors of a trajectory against a plain formulation with matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from chefbot.maths.se2 import SE2
from chefbot.slam.recorded_scan import RecordedOdometry, RecordedScan
from chefbot.slam.relations import COLUMNS, RelationsError, parse_relations, relation_errors, track_of_log

NUMBERS = st.floats(-100, 100)
POSES = st.lists(st.tuples(NUMBERS, NUMBERS, st.floats(-3.1, 3.1)), min_size=2, max_size=8)


def matrix(x: float, y: float, yaw: float) -> NDArray[np.float64]:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def line(t1: float, t2: float, x: float, y: float) -> list[float]:
    return [t1, t2, x, y, 0.0, 0.0, 0.0, 0.0]


@given(POSES, st.data())
def test_errors_are_those_of_the_matrices(
    poses: list[tuple[float, float, float]], data: st.DataObject
) -> None:
    track = np.array([(float(t), *pose) for t, pose in enumerate(poses)])
    indices = st.integers(0, len(poses) - 1)
    pairs = data.draw(st.lists(st.tuples(indices, indices, NUMBERS, NUMBERS), min_size=1, max_size=5))
    relations = np.array([line(float(a), float(b), x, y) for a, b, x, y in pairs])
    expected = []
    for a, b, x, y in pairs:
        moved = np.linalg.inv(matrix(*poses[a])) @ matrix(*poses[b])
        expected.append(np.linalg.norm(moved[:2, 2] - (x, y)))
    assert relation_errors(track, relations) == pytest.approx(np.array(expected), abs=1e-9)


@given(POSES, st.tuples(NUMBERS, NUMBERS, st.floats(-3.1, 3.1)))
def test_errors_do_not_depend_on_the_map_frame(
    poses: list[tuple[float, float, float]], frame: tuple[float, float, float]
) -> None:
    moved = [SE2(*frame) @ SE2(*pose) for pose in poses]
    tracks = [np.array([(float(t), *p) for t, p in enumerate(those)]) for those in (poses, moved)]
    relations = np.array([line(0.0, float(len(poses) - 1), 1.0, 2.0)])
    one, other = (relation_errors(track, relations) for track in tracks)
    assert one == pytest.approx(other, abs=1e-6)


def test_poses_between_are_interpolated_the_short_way_round() -> None:
    track = np.array([(0.0, 0.0, 0.0, math.pi - 0.1), (2.0, 2.0, 0.0, 0.1 - math.pi), (4.0, 4.0, 0.0, 0.0)])
    # At 1 s the robot is at (1, 0) and looks along -x: (4, 0) lies 3 m behind it.
    assert relation_errors(track, np.array([line(1.0, 4.0, -3.0, 0.0)])) == pytest.approx([0.0])


def test_a_stamp_that_occurs_twice_counts_once() -> None:
    track = np.array([(0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0), (1.0, 9.0, 0.0, 0.0), (2.0, 2.0, 0.0, 0.0)])
    assert relation_errors(track, np.array([line(0.0, 1.0, 1.0, 0.0)])) == pytest.approx([0.0])


# File


@given(st.lists(st.lists(NUMBERS, min_size=COLUMNS, max_size=COLUMNS), min_size=1, max_size=5))
def test_relations_round_trip(rows: list[list[float]]) -> None:
    text = "# t1 t2 x y z roll pitch yaw\n\n" + "".join(f"{' '.join(map(repr, row))}\n" for row in rows)
    assert parse_relations(text).tolist() == rows


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "there is no relation in it"),
        ("# nothing\n\n", "there is no relation in it"),
        ("1 2 3 4 5 6 7\n", "line 1: a relation is 8 finite numbers"),
        ("# a\n1 2 3 4 5 6 7 8 9\n", "line 2: a relation is 8 finite numbers"),
        ("1 2 3 4 5 6 7 x\n", "line 1: a relation is 8 numbers"),
        ("1 2 nan 4 5 6 7 8\n", "line 1: a relation is 8 finite numbers"),
    ],
)
def test_a_bad_line_is_reported_in_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(RelationsError, match=f"^{sentence}$"):
        parse_relations(text)


@given(st.text(max_size=60))
@example("1 2 3 4 5 6 7 inf\n")
def test_any_text_gives_relations_or_a_sentence(text: str) -> None:
    try:
        assert np.isfinite(parse_relations(text)).all()
    except RelationsError as error:
        assert "\n" not in str(error)


# Track


def scan(stamp: float, odom: SE2) -> RecordedScan:
    empty = np.empty(0, np.float32)
    return RecordedScan(stamp, empty, empty, odom, odom)


def test_odometry_continues_from_the_last_processed_scan() -> None:
    records = [
        RecordedOdometry(0.0, SE2(0.0, 0.0, 0.0)),
        scan(1.0, SE2(1.0, 0.0, 0.0)),
        RecordedOdometry(2.0, SE2(2.0, 0.0, 0.0)),
        scan(3.0, SE2(2.5, 0.0, 0.0)),  # not processed
        scan(4.0, SE2(3.0, 0.0, 0.0)),
        RecordedOdometry(5.0, SE2(3.5, 0.0, 0.0)),
    ]
    poses = [SE2(0.0, 0.0, math.pi / 2), SE2(0.5, 1.9, math.pi / 2)]
    track = track_of_log(records, [1.0, 4.0], poses)
    assert track[:, 0].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0], "nothing is known before the first scan"
    assert track[:, 1:3] == pytest.approx(
        np.array([(0.0, 0.0), (0.0, 1.0), (0.0, 1.5), (0.5, 1.9), (0.5, 2.4)])
    )


def test_a_log_without_a_processed_scan_has_no_track() -> None:
    assert track_of_log([RecordedOdometry(0.0, SE2(0.0, 0.0, 0.0))], [], []).shape == (0, 4)
