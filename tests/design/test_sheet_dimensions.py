"""The dimensions on each sheet are those of the robot file, and every part is drawn in its true size."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise

import pytest

from chefbot.design.checks.one_plane import check_one_plane
from chefbot.design.drawing.drawing import (
    MM,
    Circle,
    Item,
    Line,
    Linear,
    Plan,
    Radial,
    Text,
    item_box,
    number,
)
from chefbot.design.drawing.sheets.assembly import assembly
from chefbot.design.drawing.sheets.caster import caster
from chefbot.design.drawing.sheets.clamp import motor_clamp
from chefbot.design.drawing.sheets.parts_list import entries, table
from chefbot.design.drawing.sheets.plates import base_plate, upper_plate
from chefbot.design.drawing.sheets.turned import turned
from chefbot.robot.geometry import layout
from chefbot.robot.load import built_in_robots, load_robot
from chefbot.robot.spec import Robot

ROBOTS = [load_robot(name) for name in sorted(built_in_robots())]
FACTOR = 2.0
every_robot = pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)


def lengths(plan: Plan) -> list[float]:
    """Return what the linear dimensions measure, mm."""
    return [
        abs(one.a[0] - one.b[0]) if one.along == "x" else abs(one.a[1] - one.b[1])
        for one in plan.items
        if isinstance(one, Linear)
    ]


def radii(plan: Plan, kind: str) -> list[float]:
    return [one.radius for one in plan.items if isinstance(one, Radial) and one.kind == kind]


def assert_has(found: list[float], *metres: float) -> None:
    """Each length, m, is among those of a sheet, mm."""
    for length in metres:
        assert any(math.isclose(one, MM * length, rel_tol=1e-9, abs_tol=1e-6) for one in found), (
            length,
            found,
        )


def outlines(plan: Plan) -> list[Item]:
    return [one for one in plan.items if isinstance(one, Line | Circle) and one.layer == "OUTLINE"]


# ---- single parts


@every_robot
@pytest.mark.parametrize("kind", ["pole", "tube"])
def test_a_turned_part_has_its_length_and_diameters(robot: Robot, kind: str) -> None:
    if robot.plates.count < 2:
        pytest.skip("it has one plate")
    plan = turned(robot, kind, FACTOR)
    poles, tubes = robot.poles, robot.tubes
    sizes = {
        "pole": (poles.height, 2.0 * poles.radius, robot.plates.screw_hole),
        "tube": (tubes.length, tubes.bore + 2.0 * tubes.wall, tubes.bore),
    }[kind]
    length, outside, bore = found = sorted(lengths(plan), reverse=True)
    assert found == pytest.approx([MM * size for size in sizes])
    assert plan.title.size == f"Ø{number(outside)} x {number(length)}"
    assert plan.title.pieces == 4 * (robot.plates.count - 1) * (2 if kind == "pole" else 1)
    view = [one for one in plan.items if isinstance(one, Circle)]
    assert {round(2 * one.radius, 6) for one in view} == {round(outside, 6), round(bore, 6)}
    assert len({(one.x, one.y) for one in view}) == 1, "seen along its axis"


@every_robot
def test_a_caster_has_its_ball_and_height(robot: Robot) -> None:
    plan = caster(robot, FACTOR)
    assert radii(plan, "radius") == [pytest.approx(MM * robot.casters.radius)]
    found = lengths(plan)
    height = layout.plate_undersides(robot)[0] - layout.CASTER_GAP
    assert_has(found, height, robot.casters.radius, 2.0 * (robot.casters.radius + robot.casters.wall))
    below = [one for one in plan.items if isinstance(one, Text) and one.text == "From below"]
    assert len(below) == 1
    balls = [one for one in outlines(plan) if isinstance(one, Circle)]
    assert {round(one.radius, 6) for one in balls} >= {round(MM * robot.casters.radius, 6)}
    assert plan.title.pieces == 2


@every_robot
def test_a_clamp_has_its_three_sides_and_its_holes(robot: Robot) -> None:
    plan, clamp = motor_clamp(robot, FACTOR), robot.motor_clamp
    found = lengths(plan)
    assert_has(found, clamp.width, clamp.length, clamp.thickness)
    (sx, sy) = layout.clamp_screws(robot)[0]
    assert_has(found, 2.0 * sx, 2.0 * sy)
    shaft, screw = radii(plan, "diameter")
    assert screw == pytest.approx(MM * robot.plates.screw_hole / 2.0) and shaft > screw
    labels = [one.label for one in plan.items if isinstance(one, Radial)]
    assert labels[1] == f"4× Ø{number(2 * screw)}"
    sizes = [float(text) for text in plan.title.size.split(" x ")]
    assert sizes[:2] == pytest.approx([MM * clamp.width, MM * clamp.length], abs=0.01)
    assert plan.title.pieces == 2


@every_robot
def test_views_of_a_clamp_do_not_overlap(robot: Robot) -> None:
    plan = motor_clamp(robot, FACTOR)
    boxes = [item_box(one, FACTOR) for one in outlines(plan)]
    face = boxes[0]
    right = [box for box in boxes if box.left > face.right]
    low = [box for box in boxes if box.high < face.low]
    assert right and low and not any(box in low for box in right)


# ---- plates


@every_robot
def test_the_base_plate_has_the_size_of_the_body(robot: Robot) -> None:
    plan, plate = base_plate(robot, FACTOR), robot.body.plate
    found = lengths(plan)
    if robot.body.radius is not None:
        assert any(one == pytest.approx(MM * robot.body.radius) for one in radii(plan, "radius"))
    else:
        assert_has(found, plate.front + plate.back, 2.0 * plate.half_width)
    assert_has(found, robot.plates.thickness, 2.0 * robot.casters.offset, 2.0 * layout.clamp_middle(robot))
    assert_has(found, robot.motor_clamp.width, robot.motor_clamp.length)
    if robot.plates.notch is not None:
        assert_has(found, robot.plates.notch.length, 2.0 * layout.notch_floor(robot))
        depth = robot.plates.notch.depth
        assert any(one == pytest.approx(MM * depth) for one in found)
    assert plan.title.size == f"{number(MM * robot.plates.thickness)} thick" and plan.title.pieces == 1


@every_robot
def test_the_base_plate_names_its_parts(robot: Robot) -> None:
    plan = base_plate(robot, FACTOR)
    texts = {one.text: one for one in plan.items if isinstance(one, Text)}
    assert {"M1", "M2", "C1", "C2", "FRONT"} <= set(texts)
    assert texts["M1"].x < 0.0 < texts["M2"].x, "the left motor is on the left"
    assert texts["C1"].y > 0.0 > texts["C2"].y < texts["FRONT"].y
    poles = {name: (one.x, one.y) for name, one in texts.items() if name.startswith("P1-")}
    assert len(poles) == (4 if robot.plates.count > 1 else 0)
    for (x, y), (px, py) in zip(poles.values(), layout.pole_positions(robot), strict=False):
        assert (math.copysign(1, x), math.copysign(1, y)) == (math.copysign(1, -py), math.copysign(1, px))


@every_robot
def test_upper_plates_have_holes_for_poles_and_wiring(robot: Robot) -> None:
    for kind, index in (("middle_plate", 1), ("top_plate", robot.plates.count - 1)):
        if index < 1 or (kind == "middle_plate" and robot.plates.count < 3):
            continue
        plan = upper_plate(robot, kind, FACTOR)
        holes = [one for one in plan.items if isinstance(one, Circle) and one.layer == "HOLES"]
        reach = MM * robot.poles.reach
        screws = {(round(one.x, 6), round(one.y, 6)) for one in holes if math.hypot(one.x, one.y) > 1e-6}
        assert {(round(x * reach, 6), round(y * reach, 6)) for x, y in layout.CORNERS} <= screws
        label = next(one.label for one in plan.items if isinstance(one, Radial) and "×" in one.text)
        assert label == f"{len(screws)}× Ø{number(MM * robot.plates.screw_hole)}"
        centre = [one for one in holes if math.hypot(one.x, one.y) < 1e-6]
        assert len(centre) == (0 if kind == "top_plate" else 1)
        assert_has(lengths(plan), robot.plates.thickness, 2.0 * robot.poles.reach)


# ---- the assembly


@every_robot
def test_the_assembly_has_the_heights_of_the_plates(robot: Robot) -> None:
    plan = assembly(robot, FACTOR)
    found = lengths(plan)
    undersides = layout.plate_undersides(robot)
    gaps = [
        undersides[0],
        *(b - a - robot.plates.thickness for a, b in pairwise(undersides)),
    ]
    assert_has(found, *gaps, layout.body_height(robot), robot.wheels.separation)
    assert_has(found, 2.0 * robot.casters.offset, layout.ground_clearance(robot), robot.body.clearance)
    assert radii(plan, "diameter") == [pytest.approx(MM * robot.wheel_radius)]


@every_robot
def test_the_assembly_has_three_views_that_do_not_overlap(robot: Robot) -> None:
    plan = assembly(robot, FACTOR)
    captions = {one.text: one for one in plan.items if isinstance(one, Text) and one.height == 3.5}
    assert list(captions) == ["Front", "Right side", "Lowest deck from above"]
    front, side, deck = captions.values()
    assert front.x < side.x and deck.y < front.y, "first-angle projection"
    assert deck.x == pytest.approx(front.x, abs=30.0 * FACTOR)
    size = [float(text) for text in plan.title.size.split(" x ")]
    plate, wheels = robot.body.plate, robot.wheels
    assert size[0] >= MM * (plate.front + plate.back) - 0.01
    assert size[1] >= MM * max(2.0 * plate.half_width, wheels.separation + wheels.width) - 0.01
    assert size[2] >= MM * layout.body_height(robot) - 0.01


@every_robot
def test_the_assembly_numbers_each_part_in_one_view(robot: Robot) -> None:
    beside = Counter(one.text for one in table(robot, 0.0, 0.0, FACTOR) if isinstance(one, Text))
    numbers = Counter(one.text for one in assembly(robot, FACTOR).items if isinstance(one, Text)) - beside
    for entry in entries(robot):
        shown = numbers[str(entry.number)]
        assert shown in ((1,) if entry.kind in ("wheel", "caster", "top_plate") else (0, 1)), entry.kind


# ---- of the obstacle sensors


@every_robot
def test_one_plane_is_a_warning_for_a_lidar_alone(robot: Robot) -> None:
    findings = list(check_one_plane(robot))
    alone = robot.sensors.lidar is not None and robot.sensors.depth_camera is None
    assert len(findings) == alone
    for finding in findings:
        assert finding.severity == "warning" and "sees one plane only" in finding.sentence
