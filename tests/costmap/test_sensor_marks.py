"""Marks of one sensor: where they are after the grid has moved, and when they go."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.costmap.sensor_marks import SensorMarks, shifted
from chefbot.costmap.update_window import EMPTY_WINDOW, CellWindow
from chefbot.maths.costs import FREE, LETHAL, UNKNOWN

SHAPE = (5, 7)
OFFSETS, SIDES = st.integers(-9, 9), st.integers(1, 9)
SEEDS = st.integers(0, 10_000)


def random_marks(seed: int, *, always_near: bool = False) -> SensorMarks:
    rng = np.random.default_rng(seed)
    marks = SensorMarks.empty(SHAPE, always_near=always_near)
    marks.cells[:] = rng.choice(np.array([FREE, 90, LETHAL, UNKNOWN], np.uint8), SHAPE)
    marks.marked_at[:] = rng.integers(0, 20, SHAPE)
    return marks


def marked(marks: SensorMarks) -> set[tuple[int, int]]:
    return {(row, column) for row, column in np.argwhere(marks.cells == LETHAL).tolist()}


@settings(max_examples=40)
@given(SEEDS, OFFSETS, OFFSETS, SIDES, SIDES)
def test_every_cell_keeps_its_place_when_the_grid_moves(
    seed: int, rows: int, columns: int, height: int, width: int
) -> None:
    array = np.random.default_rng(seed).integers(1, 99, SHAPE)
    for fill in (0, 7):
        moved = shifted(array, rows, columns, (height, width), fill)
        assert moved.shape == (height, width) and moved.dtype == array.dtype
        for (row, column), value in np.ndenumerate(moved):
            at = row - rows, column - columns
            inside = 0 <= at[0] < SHAPE[0] and 0 <= at[1] < SHAPE[1]
            assert value == (array[at] if inside else fill)


@settings(max_examples=40)
@given(SEEDS, OFFSETS, OFFSETS, st.booleans())
def test_marks_move_with_their_times(seed: int, rows: int, columns: int, always_near: bool) -> None:
    marks = random_marks(seed, always_near=always_near)
    moved = marks.shifted(rows, columns, SHAPE)
    for row, column in marked(moved):
        assert moved.marked_at[row, column] == marks.marked_at[row - rows, column - columns]
    staying = {(r + rows, c + columns) for r, c in marked(marks)}
    assert marked(moved) == {cell for cell in staying if min(cell) >= 0 and cell[0] < 5 and cell[1] < 7}
    new = shifted(np.ones(SHAPE), rows, columns, SHAPE, 0.0) == 0.0
    assert (moved.cells[new] == UNKNOWN).all()
    assert moved.near_since.shape == ((0, 0) if always_near else SHAPE)


@settings(max_examples=40)
@given(SEEDS)
def test_a_selection_keeps_what_was_seen_free(seed: int) -> None:
    marks, where = random_marks(seed), np.random.default_rng(seed + 1).random(SHAPE) < 0.5
    chosen = marks.only(where)
    for (row, column), value in np.ndenumerate(marks.cells):
        goes = value == LETHAL and not where[row, column]
        assert chosen.cells[row, column] == (UNKNOWN if goes else value)
    assert np.array_equal(marks.cells, random_marks(seed).cells), "the marks themselves stay"


def window_of(cells: set[tuple[int, int]]) -> CellWindow:
    if not cells:
        return EMPTY_WINDOW
    rows, columns = zip(*cells, strict=True)
    return CellWindow(min(rows), min(columns), max(rows) + 1, max(columns) + 1)


@settings(max_examples=40)
@given(SEEDS, st.integers(-1, 21))
def test_only_marks_from_before_a_time_go(seed: int, time: int) -> None:
    marks = random_marks(seed)
    before, cells = marked(marks), marks.cells.copy()
    old = {cell for cell in before if marks.marked_at[cell] < time}
    assert marks.remove_older(float(time)) == window_of(old)
    assert marked(marks) == before - old
    assert all(marks.cells[cell] == UNKNOWN for cell in old)
    others = cells != LETHAL
    assert np.array_equal(marks.cells[others], cells[others])


PLACES = st.lists(st.tuples(st.sampled_from([1.0, 9.0]), st.booleans()), min_size=1, max_size=25)
"""Column of the robot, near or far, and whether its sensor confirms the mark, second by second."""


@settings(max_examples=40)
@given(PLACES, st.sampled_from([1.0, 3.0, 7.0]))
def test_a_mark_goes_after_a_time_nearby_without_confirmation(
    places: list[tuple[float, bool]], decay: float
) -> None:
    marks = SensorMarks.empty((1, 12), always_near=False)
    marks.cells[0, 2] = LETHAL
    missed = -1.0
    for second, (column, confirms) in enumerate(places, start=1):
        near = column == 1.0
        if near and confirms:
            marks.marked_at[0, 2] = second
        # the time that has passed nearby, since the robot came or the mark was confirmed
        missed = -1.0 if not near else 0.0 if confirms or missed < 0.0 else missed + 1.0
        window = marks.remove_missed(0.5, column, 2.0, float(second), decay)
        assert window == (CellWindow(0, 2, 1, 3) if missed > decay else EMPTY_WINDOW)
        if missed > decay:
            assert marks.cells[0, 2] == UNKNOWN
            return
        assert marks.cells[0, 2] == LETHAL


@pytest.mark.parametrize(("radius", "goes"), [(2.99, False), (3.01, True)])
def test_near_is_measured_to_the_middle_of_the_cell(radius: float, goes: bool) -> None:
    marks = SensorMarks.empty((9, 9), always_near=False)
    marks.cells[4, 7] = LETHAL
    for time in range(1, 10):
        marks.remove_missed(4.5, 4.5, radius, float(time), 5.0)
    assert (marks.cells[4, 7] == UNKNOWN) == goes


def test_an_empty_sensor_has_seen_nothing() -> None:
    marks = SensorMarks.empty((3, 4), always_near=True)
    assert (marks.cells == UNKNOWN).all() and marks.near_since.shape == (0, 0)
    assert marks.remove_older(1e9) == EMPTY_WINDOW
