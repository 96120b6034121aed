"""A rectangular body: what its keys may be, and that plates, masses, hulls and models have its shape."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import msgspec
import numpy as np
import pytest

from chefbot.design.export.mjcf import mjcf
from chefbot.design.export.urdf import urdf
from chefbot.robot.chassis import Body
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.mass import robot_mass_properties, unloaded_mass
from chefbot.robot.geometry.outlines import base_plate_outline, top_plate_outline
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_buildable

ROBOT = load_robot("jackal")
LENGTH, WIDTH = 0.508, 0.430


def with_body(**changes: float | None) -> Robot:
    body: Body = msgspec.structs.replace(ROBOT.body, **changes)
    return msgspec.structs.replace(ROBOT, body=body)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius": 0.2}, "is that of a round body"),
        ({"width": None}, "both a length and a width"),
        ({"length": None, "width": None}, "'body.radius' is missing"),
        ({"axle_offset": 0.3}, "the axle lies outside"),
        ({"axle_offset": 0.1}, "the casters stand outside"),
        ({"width": 0.25}, "body.width larger"),
    ],
)
def test_a_contradiction_is_named(changes: dict[str, float | None], message: str) -> None:
    with pytest.raises(RobotFileError, match=message):
        check_buildable(with_body(**changes), "file")


def test_plates_have_the_length_and_width_of_the_body() -> None:
    for outline in (base_plate_outline(ROBOT), top_plate_outline(ROBOT)):
        corners = np.array([(corner.x, corner.y) for corner in outline.edge])
        assert np.ptp(corners, axis=0) == pytest.approx((LENGTH, WIDTH))
    notch = ROBOT.plates.notch
    assert notch is not None
    top, base = (outline(ROBOT).edge for outline in (top_plate_outline, base_plate_outline))
    areas = [outline(ROBOT).moments().area for outline in (top_plate_outline, base_plate_outline)]
    assert len(top) == 4 and len(base) == 12
    assert areas[0] - areas[1] > 2.0 * notch.length * notch.depth


def test_an_axle_off_the_middle_moves_the_plates_back() -> None:
    shifted = with_body(axle_offset=0.02)
    check_buildable(shifted, "file")
    corners = shifted.footprint.polygon()
    assert (corners[:, 0].max(), corners[:, 0].min()) == pytest.approx(
        (LENGTH / 2 - 0.02, -LENGTH / 2 - 0.02)
    )
    assert robot_mass_properties(shifted).centre[0] < robot_mass_properties(ROBOT).centre[0]
    hull = ET.fromstring(mjcf(shifted)).find(".//geom[@name='hull']")
    assert hull is not None and float(hull.attrib["pos"].split()[0]) == pytest.approx(-0.02)


def test_the_mass_is_that_of_the_data_sheet() -> None:
    assert unloaded_mass(ROBOT) == pytest.approx(17.0, abs=0.5)


def test_the_hull_is_a_box_in_every_model() -> None:
    hull = ET.fromstring(mjcf(ROBOT)).find(".//geom[@name='hull']")
    assert hull is not None and hull.attrib["type"] == "box"
    half = [float(side) for side in hull.attrib["size"].split()]
    assert half[:2] == pytest.approx((LENGTH / 2, WIDTH / 2))
    boxes = ET.fromstring(urdf(ROBOT)).findall("./link[@name='base_link']/collision/geometry/box")
    sides = [float(side) for side in boxes[0].attrib["size"].split()]
    assert sides[:2] == pytest.approx((LENGTH, WIDTH))
