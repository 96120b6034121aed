"""Robots with a fault each: it is found, and the remedy that the finding names works."""

import json
import math

import numpy as np
import pytest
import yaml

pytest.importorskip("manifold3d")

from chefbot.cli.robot.check import run_check
from chefbot.design.checks import part_bodies
from chefbot.design.checks.finding import has_solids, nearest_valid_length, with_value
from chefbot.design.checks.geometry_checks import check
from chefbot.design.checks.ground_clearance import check_ground_clearance
from chefbot.design.checks.overlaps import overlapping
from chefbot.design.checks.sensor_occlusion import hidden_from, hidden_sectors
from chefbot.maths.units import to_si
from chefbot.robot.catalogue import load_catalogue
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import body_height
from chefbot.robot.load import built_in_robots, load_robot

CATALOGUE = load_catalogue()
ROBOTS = {name: load_robot(name) for name in ("chefbot", "chefbot_lidar")}
SI = {"mm": "m", "kg": "kg", "m/s": "m/s", "rad/s": "rad/s", "m/s^2": "m/s^2", "min": "s", "deg": "rad"}


def quantity(text):
    """`110 mm` in SI; a component's name as the component."""
    for kind in CATALOGUE:
        if text in kind:
            return kind[text]
    return to_si(text, SI[text.split(" ", 1)[1]])


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_built_in_robots_have_no_errors(name):
    assert [finding for finding in check(load_robot(name), CATALOGUE) if finding.severity == "error"] == []


FAULTS = [
    ("chefbot", "places.driver.y", -0.045, "overlap", "driver"),
    ("chefbot", "sensors.ultrasonic.mount.z", 0.02, "overlap", "ultrasonic"),
    ("chefbot", "plates.notch.length", 0.08, "notch", "base_plate"),
    ("chefbot", "plates.notch.depth", 0.017, "notch", "wheel"),
    ("chefbot", "wheels.gap", 0.0005, "notch", "motor_clamp"),
    ("chefbot", "wheels.diameter", 0.08, "clearance", "motor_clamp"),
    ("chefbot", "sensors.depth_camera.mount.x", -0.03, "view", "middle_plate"),
    ("chefbot", "sensors.depth_camera.mount.x", 0.149, "edge", "camera"),
    ("chefbot", "drive.max_speed", 0.9, "drive", "motor"),
    ("chefbot", "drive.max_turn", 9.0, "drive", "motor"),
    ("chefbot", "drive.max_acceleration", 3.0, "stability", "robot"),
    ("chefbot", "power.run_time", 18000.0, "drive", "battery"),
    ("chefbot", "battery", CATALOGUE.batteries["nimh_7v2_3ah"], "drive", "battery"),
    ("chefbot", "driver", CATALOGUE.drivers["drv8833"], "drive", "driver"),
    ("chefbot_lidar", "sensors.lidar.range_min", 0.1, "view", "tube"),
]


@pytest.mark.rotated("checks of any robot")
@pytest.mark.slow
@pytest.mark.parametrize(("name", "key", "value", "rule", "subject"), FAULTS)
def test_a_fault_is_found_and_its_remedy_fixes_it(name, key, value, rule, subject):
    robot = with_value(ROBOTS[name], key, value)
    found = [
        finding
        for finding in check(robot, CATALOGUE)
        if finding.severity == "error" and finding.rule == rule and subject in finding.subject
    ]
    assert found
    fault = found[0]
    assert fault.value and (fault.have < fault.bound) == fault.at_least
    repaired = with_value(robot, fault.key, quantity(fault.value))
    left = [(f.rule, f.subject, f.sentence) for f in check(repaired, CATALOGUE) if f.severity == "error"]
    assert (fault.rule, fault.subject, fault.sentence) not in left


@pytest.mark.rotated("checks of any robot")
@pytest.mark.parametrize(
    ("key", "value", "rule", "subject"),
    [
        ("body.payload_height", 0.9, "stability", "robot"),
        ("body.payload", 15.0, "stability", "robot"),
        pytest.param("equipment[0].place.plate", 1, "overlap", "battery, computer", marks=pytest.mark.slow),
        ("equipment[2].place.x", -0.145, "edge", "wiring"),
        ("battery", CATALOGUE.batteries["lead_12v_12ah"], "overlap", "battery, board"),
        pytest.param("tubes.length", 0.09, "bay", "battery", marks=pytest.mark.slow),
        ("plates.screw_hole", 0.009, "hole", "base_plate"),
        ("sensors.ultrasonic.mount.z", 0.02, "clearance", "ultrasonic"),
        ("sensors.depth_camera.mount.pitch", 0.9, "view", "middle_plate"),
    ],
)
def test_faults_of_several_values_are_found(key, value, rule, subject):
    found = check(with_value(ROBOTS["chefbot"], key, value), CATALOGUE)
    assert any(finding.rule == rule and subject in finding.subject for finding in found)


def test_wheels_above_and_casters_below_the_floor_are_found(monkeypatch):
    """No robot file can say that, as heights follow from the wheels: here the derivation is made wrong."""
    robot = with_value(ROBOTS["chefbot"], "name", "on_stilts")
    assert list(check_ground_clearance(robot)) == []
    monkeypatch.setattr(layout, "CASTER_GAP", -0.002)
    origin = part_bodies.link_origin

    def raised(robot, link):
        x, y, z = origin(robot, link)
        return (x, y, z + 0.003) if link == "wheel_left_link" else (x, y, z)

    monkeypatch.setattr(part_bodies, "link_origin", raised)
    found = list(check_ground_clearance(with_value(robot, "name", "on_other_stilts")))
    subjects = {f.subject: f.have for f in found if f.rule == "floor"}
    assert subjects == {
        "wheel_left": pytest.approx(0.003, abs=1e-5),
        "caster_front": pytest.approx(-0.002, abs=1e-4),
        "caster_back": pytest.approx(-0.002, abs=1e-4),
    }


def test_only_buildable_remedies_are_tried():
    """A clamp narrower than its screw holes has no solid: to look for its triangles would never end."""
    tried = []
    assert nearest_valid_length(ROBOTS["chefbot"], ["motor_clamp.width"], tried.append) == ("", "")
    assert len(tried) > 10 and all(has_solids(robot) for robot in tried)


@pytest.mark.rotated("checks of any robot")
@pytest.mark.slow
def test_a_support_removed_by_a_remedy_blocks_nothing():
    """A battery that is too high reaches into the lidar's stand; a lower lidar has none."""
    desk = with_value(load_robot("desk"), "battery", CATALOGUE.batteries["lifepo4_12v8_4ah5"])
    found = check(desk, CATALOGUE)
    assert any(f.rule == "overlap" and "laser_stand" in f.subject for f in found)


def test_an_overlap_has_the_volume_of_the_shared_box():
    robot = with_value(ROBOTS["chefbot"], "places.driver.y", -0.04)
    pairs = [pair for pair in overlapping(robot) if {pair.one.name, pair.other.name} == {"battery", "driver"}]
    depth = (robot.battery.size.y + robot.driver.size.y) / 2 - 0.04
    wanted = robot.driver.size.x * depth * robot.driver.size.z
    assert [pair.volume for pair in pairs] == pytest.approx([wanted], rel=1e-6)


def test_tubes_reduce_the_lidar_field_of_view():
    robot = ROBOTS["chefbot_lidar"]
    radius = robot.tubes.bore / 2 + robot.tubes.wall
    away = math.hypot(robot.poles.reach, robot.poles.reach)
    sectors = hidden_sectors(robot, robot.sensors.lidar)
    assert sectors.angle == pytest.approx(8 * math.asin(radius / away), rel=1e-3)
    assert sectors.farthest == pytest.approx(math.sqrt(away**2 - radius**2), rel=0.01)


def test_camera_occlusion_by_a_plate_equals_ray_casting():
    """Rays through the middle of each pixel against the discs, which is another way than cutting and projecting."""
    robot = with_value(ROBOTS["chefbot"], "sensors.depth_camera.mount.x", -0.03)
    hidden = hidden_from(robot, "camera", "depth_camera")
    camera, plate = (
        robot.sensors.depth_camera,
        body_height(robot) - 2 * robot.plates.thickness - robot.tubes.length,
    )
    columns, rows = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    y = (columns - camera.width / 2) / camera.focal_length_px
    z = (camera.height / 2 - rows) / camera.focal_length_px
    top = plate + robot.plates.thickness
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (top - camera.mount.z) / z
        seen = (reach > 0) & (np.hypot(camera.mount.x + reach, reach * y) < robot.body.radius)
    assert hidden.by_part["middle_plate"] == pytest.approx(seen.mean(), abs=2e-3)


@pytest.mark.slow
def test_check_prints_its_findings_and_sets_the_exit_code(capsys, tmp_path):
    assert run_check("chefbot", as_json=True, out=None) == 0
    assert {f["severity"] for f in json.loads(capsys.readouterr().out)["findings"]} == {"warning"}
    bad = tmp_path / "bad.yaml"
    bad.write_text(yaml.safe_dump({"like": "chefbot", "name": "bad", "places": {"driver": {"y": "-4 cm"}}}))
    picture = tmp_path / "bad.png"
    assert run_check(str(bad), as_json=False, out=picture) == 1
    text = capsys.readouterr().out
    assert "places.driver.y" in text and "1 error" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
