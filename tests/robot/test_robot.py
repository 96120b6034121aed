"""Robot files: those that come with the package, and those that cannot be."""

import math

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.config import ConfigError, build
from chefbot.design.checks.geometry_checks import check
from chefbot.robot.catalogue import KINDS, load_catalogue
from chefbot.robot.errors import RobotFileError
from chefbot.robot.geometry.layout import body_height, ground_clearance, overall_height
from chefbot.robot.geometry.mass import robot_mass_properties, total_mass, unloaded_mass
from chefbot.robot.load import build_robot, built_in_robots, load_robot
from chefbot.robot.motion_limits import (
    contact_speed,
    max_acceleration,
    max_deceleration,
    max_speed,
    max_turn,
    max_turn_acceleration,
    max_turn_deceleration,
    max_wheel_speed,
    one_plane_warning,
)
from chefbot.robot.spec import GRAVITY, Robot
from chefbot.robot.validation import check_buildable
from chefbot.strict_yaml import load_strict

CHEFBOT = load_robot("chefbot")
TEXT = built_in_robots()["chefbot"].read_text()


def spelled(section):
    """The catalogue's entry that the Chefbot names, as a section that a person could write."""
    entry = load_strict((built_in_robots()["chefbot"].parent / "catalogue" / KINDS[section][0]).read_text())
    return dict(entry[load_strict(TEXT)[section]])


def changed(**sections):
    """The Chefbot's file with some keys of some sections set; a key set to None is taken out."""
    data = load_strict(TEXT)
    for section, keys in sections.items():
        if section in KINDS:
            data[section] = spelled(section)
        for key, value in keys.items():
            place, path = data[section], key.split("__")
            for name in path[:-1]:
                place = place[int(name) if name.isdigit() else name]
            if value is None:
                del place[path[-1]]
            else:
                place[path[-1]] = value
    return data


def load(data):
    return build_robot(data, "robot file r.yaml")


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_built_in_robots_load_and_are_buildable(name):
    robot = load_robot(name)
    assert robot.name == name
    check_buildable(robot, name)
    assert hash(robot) == hash(load_robot(name)) and robot == load_robot(name)


def test_the_lidar_robot_differs_by_its_lidar_only():
    lidar = load_robot("chefbot_lidar")
    sensors = msgspec.structs.replace(lidar.sensors, lidar=None)
    assert msgspec.structs.replace(lidar, name="chefbot", sensors=sensors) == CHEFBOT


def test_the_chefbot_meets_the_requirements_of_its_chapter():
    """Payload 2 kg, body 3 kg by its budget, 0.35 m/s, 3 cm above ground, 2 h, 9 cm wheels, 30 cm plates."""
    assert (CHEFBOT.body.payload, CHEFBOT.body.mass_budget) == (2.0, 3.0)
    assert total_mass(CHEFBOT) == pytest.approx(unloaded_mass(CHEFBOT) + 2.0)
    assert max_speed(CHEFBOT) == pytest.approx(0.35)
    assert CHEFBOT.body.clearance == pytest.approx(0.03) and ground_clearance(CHEFBOT) >= 0.03
    assert CHEFBOT.power.run_time == 7200.0
    assert CHEFBOT.wheel_radius == pytest.approx(0.045)
    assert CHEFBOT.metres_per_tick * CHEFBOT.motor.ticks_per_turn == pytest.approx(math.pi * 0.09)
    assert CHEFBOT.circumscribed_radius >= math.hypot(0.1425, 0.045) - 1e-12
    assert CHEFBOT.motor == load_catalogue().motors["pololu_37d_102"]


@pytest.mark.parametrize(
    ("section", "key", "value", "sentence"),
    [
        ("body", "radius", "15", "no unit"),
        ("body", "radius", 15, "no unit"),
        ("body", "radius", "15 kg", "not a quantity in m"),
        ("body", "raduis", "15 cm", "did you mean 'radius'"),
        ("body", "radius", None, "'body.radius' is missing"),
        ("body", "radius", "-15 cm", "body.radius"),
        ("body", "radius", "0 cm", "body.radius"),
        ("body", "radius", "nan m", "body.radius"),
        ("body", "radius", "inf m", "body.radius"),
        ("body", "payload", "1e300 kg", "body.payload"),
        ("body", "clearance", "10 cm", "body.clearance"),
        ("body", "clearance", "-1 cm", "body.clearance"),
        ("plates", "notch__depth", "0.1 cm", "plates.notch: lies outside the plate"),
        ("plates", "notch__length", "29 cm", "plates.notch: lies outside the plate"),
        ("plates", "notch__depth", "20 cm", "plates.notch.depth: is deeper than the plate"),
        ("plates", "centre_hole", "25 cm", "plates.centre_hole"),
        ("plates", "material", "acryl", "did you mean 'acrylic'"),
        ("plates", "screw_hole", "14 mm", "as wide as the poles"),
        ("poles", "radius", "8 mm", "tubes.bore: poles of 16 mm do not go in"),
        ("poles", "height", "8 cm", "longer than the tube"),
        ("poles", "reach", "11 cm", "outside the plates"),
        ("wheels", "separation", "1 cm", "overlap"),
        ("wheels", "separation", "2 m", "stand clear"),
        ("wheels", "separation", "16 cm", "does not fit"),
        ("motor", "diameter", "12 cm", "wheels.diameter: the motor of 120 mm would touch the floor"),
        ("casters", "offset", "40 cm", "outside the body"),
        ("casters", "radius", "4 cm", "casters"),
        ("motor", "stall_torque", "0.01 N m", "cannot roll"),
        ("motor", "diameter", "40 cm", "wider than the plate"),
        ("motor", "length", "20 cm", "does not fit"),
        ("motor", "shaft_diameter", "3 cm", "narrower than the hole"),
        ("motor", "encoder_counts", 0, "encoder_counts"),
        ("motor", "encoder_counts", 42.5, "encoder_counts"),
        ("motor", "no_load_current", "9 A", "not below motor.stall_current"),
        ("motor_clamp", "width", "1 cm", "motor_clamp.width"),
        ("motor_clamp", "width", "1.4 cm", "screws need more than 15 mm"),
        ("motor_clamp", "length", "6 mm", "no material round screws"),
        ("motor", "shaft_offset", "14 mm", "breaks out of the clamp"),
        ("battery", "empty_voltage", "13 V", "not below battery.voltage"),
        ("battery", "voltage", "15 V", "above battery.full_voltage"),
        ("driver", "voltage_min", "30 V", "not below driver.voltage_max"),
        ("places", "battery__plate", 5, "there is no plate 5"),
        ("equipment", "0__place__plate", 6, "equipment[0].place.plate"),
        ("sensors", "depth_camera__range_min", "9 m", "not below range_max"),
        ("sensors", "depth_camera__field_of_view", "170 deg", "not a camera"),
        ("sensors", "depth_camera__width", 1_000_000, "megapixels"),
        ("sensors", "depth_camera__mount__x", "80 cm", "outside the body"),
        ("sensors", "ultrasonic__mount__z", "90 cm", "between floor and top"),
        ("sensors", "depth_camera", None, "could not see"),
        ("sensors", "imu__gyro_noise", "-1 deg/s", "gyro_noise"),
    ],
)
def test_an_impossible_robot_is_reported_in_one_sentence(section, key, value, sentence):
    with pytest.raises(ConfigError) as caught:
        load(changed(**{section: {key: value}}))
    assert sentence in str(caught.value)
    assert str(caught.value).startswith("robot file r.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("section", sorted(KINDS))
def test_a_part_is_a_catalogue_name_or_a_section(section):
    """Both give the same robot; a name that is not in the catalogue gets the nearest one."""
    assert load(changed(**{section: {}})) == CHEFBOT
    name = load_strict(TEXT)[section]
    with pytest.raises(RobotFileError, match=rf"{section}: the catalogue has no .*did you mean '{name}'"):
        load({**load_strict(TEXT), section: name + "x"})
    with pytest.raises(ConfigError, match=rf"{section}"):
        load({**load_strict(TEXT), section: 7})


def test_equipment_names_must_be_unique():
    twice = load_strict(TEXT)
    twice["equipment"][1]["name"] = "computer"
    with pytest.raises(RobotFileError, match="computer"):
        load(twice)
    for name in ("motor_left", "base_link", "camera_link"):
        twice["equipment"][1]["name"] = name
        with pytest.raises(RobotFileError, match=name):
            load(twice)


@pytest.mark.parametrize("name", ["battery", "base_link", "base_footprint", "imu_link", "wheel_left"])
def test_a_robot_may_not_have_the_name_of_a_part(name):
    with pytest.raises(RobotFileError, match=f"name: a part of the robot is called '{name}' too"):
        load({**load_strict(TEXT), "name": name})


def test_robots_are_found_by_name_and_path(tmp_path):
    with pytest.raises(RobotFileError, match="did you mean 'chefbot'"):
        load_robot("chefbit")
    with pytest.raises(ConfigError, match="does not exist"):
        load_robot(str(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text(TEXT.replace("name: chefbot", "name: mine"))
    assert load_robot(str(tmp_path / "mine.yaml")).name == "mine"
    (tmp_path / "mine.yaml").write_text(TEXT + "\nname: twice\n")
    with pytest.raises(ConfigError, match="is given twice"):
        load_robot(str(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text(TEXT.replace("name: chefbot", "name: ../../etc"))
    with pytest.raises(ConfigError, match="name"):
        load_robot(str(tmp_path / "mine.yaml"))


def test_a_robot_file_that_extends_another_overrides_values(tmp_path):
    (tmp_path / "one.yaml").write_text("like: chefbot\nname: one\nwheels: {diameter: 10 cm}\n")
    (tmp_path / "two.yaml").write_text("like: one.yaml\nname: two\nbody: {payload: 1 kg}\n")
    two = load_robot(str(tmp_path / "two.yaml"))
    assert (two.name, two.wheels.diameter, two.body.payload) == ("two", 0.1, 1.0)
    wheels = msgspec.structs.replace(CHEFBOT.wheels, diameter=0.1)
    body = msgspec.structs.replace(CHEFBOT.body, payload=1.0)
    assert two == msgspec.structs.replace(CHEFBOT, name="two", wheels=wheels, body=body)


@pytest.mark.parametrize(
    ("text", "kind"),
    [("name: office\nwalls: []\n", "world"), ("image: office.pgm\nresolution: 0.05\n", "map")],
)
def test_another_file_given_as_a_robot_is_named(tmp_path, text, kind):
    (tmp_path / "office.yaml").write_text(text)
    (tmp_path / "mine.yaml").write_text("like: office.yaml\n")
    for name in ("office.yaml", "mine.yaml"):
        with pytest.raises(RobotFileError, match=f"office.yaml is a {kind}, not a robot file"):
            load_robot(str(tmp_path / name))


@pytest.mark.parametrize(
    ("like", "sentence"),
    [
        ("two.yaml", "refers back to itself"),
        ("one.yaml", "refers back to itself"),
        ("nowhere.yaml", "does not exist"),
        ("chefbit", r"two.yaml: like: .*did you mean 'chefbot'"),
        ("[chefbot]", "must be the name"),
        ("/etc/passwd", "not valid YAML|must be|missing|Expected|sections"),
    ],
)
def test_a_circular_or_missing_base_robot_has_one_sentence(tmp_path, like, sentence):
    (tmp_path / "one.yaml").write_text("like: two.yaml\nname: one\n")
    (tmp_path / "two.yaml").write_text(f"like: {like}\nname: two\n")
    with pytest.raises(ConfigError, match=sentence):
        load_robot(str(tmp_path / "one.yaml"))


def decade(low, high):
    """Numbers evenly over the orders of magnitude."""
    exponent = st.floats(math.log(low), math.log(high))
    return exponent.map(lambda x: min(max(math.exp(x), low), high))


@st.composite
def robots(draw):
    data = changed(
        body={"payload": f"{draw(decade(0.1, 100))} kg", "radius": f"{draw(decade(0.14, 1.0))} m"},
        wheels={
            "diameter": f"{draw(decade(0.031, 0.3))} m",
            "separation": f"{draw(decade(0.05, 2.0))} m",
            "friction": draw(decade(0.05, 2)),
        },
        motor={
            "stall_torque": f"{draw(decade(0.01, 50))} N m",
            "no_load_speed": f"{draw(decade(0.5, 50))} rad/s",
            "encoder_counts": draw(st.integers(1, 100_000)),
        },
        drive={
            "max_speed": f"{draw(decade(0.01, 10))} m/s",
            "max_turn": f"{draw(decade(0.01, 50))} rad/s",
            "max_acceleration": f"{draw(decade(0.01, 50))} m/s^2",
            "max_turn_acceleration": f"{draw(decade(0.01, 500))} rad/s^2",
        },
    )
    data["driver"], data["battery"] = spelled("driver"), spelled("battery")
    robot = build(data, Robot, "r")
    assume(max_wheel_speed(robot) > 0.0)
    return robot


@settings(max_examples=40)
@given(robots())
@pytest.mark.slow
def test_limits_respect_owner_motors_and_floor(robot):
    no_load_speed = robot.motor.no_load_speed * robot.wheel_radius
    half = robot.wheels.separation / 2
    assert 0 < max_wheel_speed(robot) <= no_load_speed
    assert 0 < max_speed(robot) <= min(robot.drive.max_speed, no_load_speed)
    assert 0 < max_turn(robot) <= robot.drive.max_turn
    assert max_turn(robot) * half <= max_wheel_speed(robot) * (1 + 1e-12)
    push = 2 * robot.motor.stall_torque / robot.wheel_radius
    assert 0 < max_acceleration(robot) <= robot.drive.max_acceleration
    assert max_acceleration(robot) * total_mass(robot) <= push
    assert max_acceleration(robot) <= robot.wheels.friction * GRAVITY
    assert 0 < max_turn_acceleration(robot) <= robot.drive.max_turn_acceleration
    assert max_turn_acceleration(robot) * half <= max_acceleration(robot) * (1 + 1e-12)
    assert robot.circumscribed_radius >= max(robot.body.radius, robot.wheel_radius, half)


FIGURES = (
    *(max_wheel_speed, max_speed, max_turn, max_acceleration, max_turn_acceleration),
    *(max_deceleration, max_turn_deceleration),
    *(body_height, overall_height, ground_clearance, unloaded_mass, total_mass),
)


@pytest.mark.slow
@settings(max_examples=20)
@given(robots())
def test_a_buildable_robot_has_finite_figures(robot):
    try:
        check_buildable(robot, "robot file r.yaml")
    except ConfigError as error:
        assert str(error).startswith("robot file r.yaml: ")
        return
    names = [name for name, kind in vars(Robot).items() if isinstance(kind, property) and name != "footprint"]
    numbers = [*(getattr(robot, name) for name in names), *(figure(robot) for figure in FIGURES)]
    assert len(numbers) >= 14
    assert all(math.isfinite(number) and number > 0 for number in numbers)
    assert all(
        math.isfinite(x)
        for x in (*robot_mass_properties(robot).centre, *robot_mass_properties(robot).inertia)
    )


def test_a_robot_file_has_every_key_exactly_once():
    """Every key of the Chefbot's file is needed or has another default; unknown ones were refused."""
    data = load_strict(TEXT)
    sections = (
        "body",
        "plates",
        "poles",
        "tubes",
        "motor_clamp",
        "wheels",
        "casters",
        "power",
        "drive",
        *KINDS,
    )
    for section in sections:
        for key in spelled(section) if section in KINDS else data[section]:
            if (section, key) in {("plates", "notch"), ("driver", "enable_diag")}:
                continue  # without it there is none
            with pytest.raises(ConfigError, match=f"{section}.{key}"):
                load(changed(**{section: {key: None}}))


def test_a_robot_that_sees_one_plane_is_slow() -> None:
    jackal, desk, both = load_robot("jackal"), load_robot("desk"), load_robot("chefbot_lidar")
    assert max_speed(jackal) == contact_speed(jackal) < 0.25 < jackal.drive.max_speed
    assert max_speed(desk) == desk.drive.max_speed < contact_speed(desk)
    assert not both.sensors.sees_one_plane and one_plane_warning(both) == ""
    assert "at most 0.21 m/s" in one_plane_warning(jackal)
    findings = [finding for finding in check(jackal, load_catalogue()) if finding.rule == "one plane"]
    assert [finding.severity for finding in findings] == ["warning"]
