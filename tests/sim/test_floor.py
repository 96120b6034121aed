"""The floor of a world with holes: slabs cover all but the holes; carpets lie where they are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chefbot.buildings.world_file import Carpet, FloorHole
from chefbot.sim.cameras.depth_holes import hole_array
from chefbot.sim.world.floor import carpet_at, floor_slabs, over_holes
from chefbot.sim.world.shapes import clearance

BOUNDS = (-5.0, -4.0, 5.0, 4.0)
HOLES = st.lists(
    st.builds(
        lambda x, y, w, d, depth: FloorHole(name="hole", x=x, y=y, size=[w, d], depth=depth),
        *(
            st.floats(-4.0, 4.0),
            st.floats(-3.0, 3.0),
            st.floats(0.3, 2.0),
            st.floats(0.3, 2.0),
            st.floats(0.1, 1.0),
        ),
    ),
    min_size=1,
    max_size=4,
)


def is_over(hole: FloorHole, x: float, y: float, margin: float) -> bool:
    return abs(x - hole.x) < hole.size[0] / 2 + margin and abs(y - hole.y) < hole.size[1] / 2 + margin


@given(HOLES, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_slabs_cover_all_but_the_holes(holes: list[FloorHole], x: float, y: float) -> None:
    slabs = [slab for slab in floor_slabs(BOUNDS, holes) if slab.top > -1e-9]
    covered = clearance(slabs, x, y, -0.01, 0.01) == 0.0
    if not any(is_over(hole, x, y, 1e-6) for hole in holes):
        assert covered
    elif any(is_over(hole, x, y, -1e-6) for hole in holes):
        assert not covered


@given(HOLES)
def test_every_hole_has_a_bottom(holes: list[FloorHole]) -> None:
    bottoms = [slab for slab in floor_slabs(BOUNDS, holes) if slab.top < -1e-9]
    for hole in holes:
        tops = [slab.top for slab in bottoms if clearance([slab], hole.x, hole.y, -9.0, 9.0) == 0.0]
        assert max(tops) >= -hole.depth - 1e-9 and min(tops) < 0.0


def test_obstacles_over_holes_have_their_size() -> None:
    (one,) = over_holes([FloorHole(name="shaft", x=1.0, y=2.0, size=[0.6, 0.4], depth=1.0)], 0.5)
    assert (one.x, one.y, one.extent, one.bottom, one.top) == (1.0, 2.0, (0.3, 0.2), 0.0, 0.5)


@given(st.floats(-3.1, 3.1), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_a_turned_carpet_lies_where_it_is_drawn(yaw: float, along: float, across: float) -> None:
    carpet = Carpet(x=1.0, y=-1.0, yaw=yaw, size=[2.0, 1.0], friction=0.4)
    x = 1.0 + along * math.cos(yaw) - across * math.sin(yaw)
    y = -1.0 + along * math.sin(yaw) + across * math.cos(yaw)
    inside = abs(along) < 1.0 - 1e-6 and abs(across) < 0.5 - 1e-6
    outside = abs(along) > 1.0 + 1e-6 or abs(across) > 0.5 + 1e-6
    found = carpet_at([carpet], x, y)
    assert not inside or found is carpet
    assert not outside or found is None


def test_the_uppermost_carpet_counts() -> None:
    lower, upper = (Carpet(x=0.0, y=0.0, size=[2.0, 2.0], friction=f) for f in (0.4, 0.9))
    assert carpet_at([lower, upper], 0.5, 0.5) is upper


def test_holes_are_rows_of_corners_and_depth() -> None:
    rows = hole_array([FloorHole(name="shaft", x=1.0, y=2.0, size=[0.6, 0.4], depth=0.7)])
    np.testing.assert_allclose(rows, [[0.7, 1.8, 1.3, 2.2, 0.7]])
    assert hole_array([]).shape == (0, 5)
    assert pytest.approx(0.7) == rows[0, 4]
