"""Plans of single parts: the same part at every scale, and a parts list without gaps."""

from __future__ import annotations

import math

import pytest

from chefbot.design.drawing.drawing import MM, Line, Linear, Plan, Text
from chefbot.design.drawing.sheets import SHEETS
from chefbot.design.drawing.sheets.common import cross, pieces, row, title
from chefbot.design.drawing.sheets.parts_list import entries, table
from chefbot.robot.geometry.solids import solids
from chefbot.robot.load import built_in_robots, load_robot

ROBOTS = [load_robot(name) for name in sorted(built_in_robots())]
CHEFBOT = load_robot("chefbot")
SHEET_NAMES = ("base_plate", "motor_clamp", "caster", "pole", "tube", "assembly")
PLANS = {name: SHEETS[name] for name in SHEET_NAMES}


def outline(plan: Plan) -> list[list[tuple[float, float]]]:
    """Corners of all outline segments, mm, each view moved to its own lower left corner."""
    found = []
    for item in plan.items:
        if isinstance(item, Line) and item.layer == "OUTLINE":
            left = min(corner.x for corner in item.corners)
            low = min(corner.y for corner in item.corners)
            found.append([(round(c.x - left, 6), round(c.y - low, 6)) for c in item.corners])
    return found


@pytest.mark.parametrize("name", [name for name in PLANS if name != "assembly"])
def test_outlines_do_not_depend_on_the_scale(name: str) -> None:
    small, large = (PLANS[name](CHEFBOT, factor) for factor in (1.0, 5.0))
    assert outline(small) == outline(large)
    assert small.title == large.title


@pytest.mark.parametrize("name", PLANS)
def test_dimensions_have_a_positive_finite_length(name: str) -> None:
    lengths = [
        abs(item.a[0] - item.b[0]) if item.along == "x" else abs(item.a[1] - item.b[1])
        for item in PLANS[name](CHEFBOT, 2.0).items
        if isinstance(item, Linear)
    ]
    assert lengths and all(0.0 < length < 10.0 * MM for length in lengths)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_parts_list_has_every_part_once(robot) -> None:
    found = entries(robot)
    listed = [part for entry in found for part in entry.parts]
    assert [entry.number for entry in found] == list(range(1, len(found) + 1))
    assert sorted(part.name for part in listed) == sorted(part.name for part in solids(robot))
    assert all({part.kind for part in entry.parts} == {entry.kind} for entry in found)


def test_the_table_has_a_line_for_each_entry_within_its_frame() -> None:
    items = table(CHEFBOT, 10.0, 200.0, 1.0)
    texts = [item for item in items if isinstance(item, Text)]
    lines = [item for item in items if isinstance(item, Line)]
    assert len({text.y for text in texts}) == len(entries(CHEFBOT)) + 1
    corners = [corner for line in lines for corner in line.corners]
    low, high = min(c.y for c in corners), max(c.y for c in corners)
    assert high == 200.0 and all(low < text.y < high for text in texts)


def test_the_title_gives_number_and_mass_of_equal_parts() -> None:
    poles = pieces(CHEFBOT, "pole")
    block = title(CHEFBOT, "pole", "size")
    assert (block.part, block.pieces, block.mass) == ("Pole", len(poles), poles[0].mass)
    assert math.isclose(poles[0].mass, poles[-1].mass)


def test_centre_lines_cross_beyond_the_circle() -> None:
    first, second = cross(1.0, 2.0, 5.0, 2.0)
    for line in (first, second):
        assert isinstance(line, Line)
        ends = [(corner.x, corner.y) for corner in line.corners]
        assert math.dist(*ends) > 10.0
        assert tuple(sum(end[i] for end in ends) / 2 for i in (0, 1)) == pytest.approx((1.0, 2.0))
    assert row(1, 1.0) > row(0, 1.0) and row(2, 5.0) == pytest.approx(5.0 * row(2, 1.0))
