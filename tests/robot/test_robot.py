"""Robot files: those that come with the package, and those that cannot be."""

import math

import msgspec
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chefbot.config import build
from chefbot.errors import UserError
from chefbot.robot.load import built_in_robots, check_possible, load_robot
from chefbot.robot.spec import GRAVITY, Robot

CHEFBOT = load_robot("chefbot")
TEXT = built_in_robots()["chefbot"].read_text()


def changed(**sections):
    """The Chefbot's file with some keys of some sections set; a key set to None is taken out."""
    data = yaml.safe_load(TEXT)
    for section, keys in sections.items():
        for key, value in keys.items():
            place, path = data[section], key.split("__")
            for name in path[:-1]:
                place = place[name]
            if value is None:
                del place[path[-1]]
            else:
                place[path[-1]] = value
    return data


def load(data):
    robot = build(data, Robot, "robot file r.yaml")
    check_possible(robot, "robot file r.yaml")
    return robot


@pytest.mark.parametrize("name", sorted(built_in_robots()))
def test_built_in_robots_load_and_can_be(name):
    robot = load_robot(name)
    assert robot.name == name
    check_possible(robot, name)
    assert hash(robot) == hash(load_robot(name)) and robot == load_robot(name)


def test_the_lidar_robot_differs_by_its_lidar_only():
    lidar = load_robot("chefbot_lidar")
    sensors = msgspec.structs.replace(lidar.sensors, lidar=None)
    assert msgspec.structs.replace(lidar, name="chefbot", sensors=sensors) == CHEFBOT


def test_the_chefbot_is_what_its_chapter_asks_for():
    """Payload 2 kg, body 3 kg, 0.35 m/s, 3 cm above ground, 2 h, 9 cm wheels, 10 kg cm, 80 rpm."""
    assert (CHEFBOT.body.payload, CHEFBOT.body.mass, CHEFBOT.total_mass) == (2.0, 3.0, 5.0)
    assert CHEFBOT.max_speed == pytest.approx(0.35)
    assert CHEFBOT.body.clearance == pytest.approx(0.03)
    assert CHEFBOT.battery.run_time == 7200.0
    assert CHEFBOT.wheel_radius == pytest.approx(0.045)
    assert CHEFBOT.motor.stall_torque == pytest.approx(0.1 * GRAVITY)
    assert CHEFBOT.metres_per_tick * CHEFBOT.motor.ticks_per_turn == pytest.approx(math.pi * 0.09)
    assert CHEFBOT.footprint_radius >= math.hypot(0.155, 0.045) - 1e-12


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
        ("body", "mass", "1e300 kg", "body.mass"),
        ("body", "clearance", "10 cm", "body.clearance"),
        ("wheels", "separation", "1 cm", "overlap"),
        ("wheels", "separation", "2 m", "stand clear"),
        ("wheels", "mass", "1.5 kg", "weigh more"),
        ("casters", "offset", "40 cm", "outside the body"),
        ("motor", "stall_torque", "0.01 N m", "cannot roll"),
        ("motor", "ticks_per_turn", 0, "ticks_per_turn"),
        ("motor", "ticks_per_turn", 4200.5, "ticks_per_turn"),
        ("battery", "empty_voltage", "12 V", "not below battery.voltage"),
        ("sensors", "depth_camera__range_min", "9 m", "not below range_max"),
        ("sensors", "depth_camera__field_of_view", "170 deg", "no camera"),
        ("sensors", "depth_camera__width", 1_000_000, "megapixels"),
        ("sensors", "depth_camera__mount__x", "80 cm", "outside the body"),
        ("sensors", "ultrasonic__mount__z", "90 cm", "between floor and top"),
        ("sensors", "depth_camera", None, "could not see"),
        ("sensors", "imu__gyro_noise", "-1 deg/s", "gyro_noise"),
    ],
)
def test_an_impossible_robot_is_a_sentence(section, key, value, sentence):
    with pytest.raises(UserError) as caught:
        load(changed(**{section: {key: value}}))
    assert sentence in str(caught.value)
    assert str(caught.value).startswith("robot file r.yaml")


def test_names_and_paths(tmp_path):
    with pytest.raises(UserError, match="did you mean 'chefbot'"):
        load_robot("chefbit")
    with pytest.raises(UserError, match="does not exist"):
        load_robot(str(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text(TEXT.replace("name: chefbot", "name: mine"))
    assert load_robot(str(tmp_path / "mine.yaml")).name == "mine"
    (tmp_path / "mine.yaml").write_text(TEXT + "\nname: twice\n")
    with pytest.raises(UserError, match="stands twice"):
        load_robot(str(tmp_path / "mine.yaml"))
    (tmp_path / "mine.yaml").write_text(TEXT.replace("name: chefbot", "name: ../../etc"))
    with pytest.raises(UserError, match="name"):
        load_robot(str(tmp_path / "mine.yaml"))


def decade(low, high):
    """Numbers evenly over the orders of magnitude."""
    exponent = st.floats(math.log(low), math.log(high))
    return exponent.map(lambda x: min(max(math.exp(x), low), high))


@st.composite
def robots(draw):
    data = changed(
        body={
            "mass": f"{draw(decade(0.5, 200))} kg",
            "payload": f"{draw(decade(0.1, 100))} kg",
            "radius": f"{draw(decade(0.05, 1.0))} m",
        },
        wheels={
            "diameter": f"{draw(decade(0.031, 0.3))} m",
            "separation": f"{draw(decade(0.05, 2.0))} m",
            "friction": draw(decade(0.05, 2)),
        },
        motor={
            "stall_torque": f"{draw(decade(0.01, 50))} N m",
            "no_load_speed": f"{draw(decade(0.5, 50))} rad/s",
            "ticks_per_turn": draw(st.integers(1, 100_000)),
        },
        drive={
            "max_speed": f"{draw(decade(0.01, 10))} m/s",
            "max_turn": f"{draw(decade(0.01, 50))} rad/s",
            "max_acceleration": f"{draw(decade(0.01, 50))} m/s^2",
            "max_turn_acceleration": f"{draw(decade(0.01, 500))} rad/s^2",
        },
    )
    robot = build(data, Robot, "r")
    assume(robot.max_wheel_speed > 0.0)
    return robot


@settings(max_examples=80, deadline=None)
@given(robots())
def test_no_limit_exceeds_what_owner_motors_and_floor_give(robot):
    rim = robot.motor.no_load_speed * robot.wheel_radius
    half = robot.wheels.separation / 2
    assert 0 < robot.max_wheel_speed <= rim
    assert 0 < robot.max_speed <= min(robot.drive.max_speed, rim)
    assert 0 < robot.max_turn <= robot.drive.max_turn
    assert robot.max_turn * half <= robot.max_wheel_speed * (1 + 1e-12)
    push = 2 * robot.motor.stall_torque / robot.wheel_radius
    assert 0 < robot.max_acceleration <= robot.drive.max_acceleration
    assert robot.max_acceleration * robot.total_mass <= push
    assert robot.max_acceleration <= robot.wheels.friction * GRAVITY
    assert 0 < robot.max_turn_acceleration <= robot.drive.max_turn_acceleration
    assert robot.max_turn_acceleration * half <= robot.max_acceleration * (1 + 1e-12)
    assert robot.footprint_radius >= max(robot.body.radius, robot.wheel_radius, half)


@settings(max_examples=30, deadline=None)
@given(robots())
def test_a_possible_robot_has_finite_numbers_and_an_impossible_one_a_sentence(robot):
    try:
        check_possible(robot, "robot file r.yaml")
    except UserError as error:
        assert str(error).startswith("robot file r.yaml: ")
    numbers = [getattr(robot, name) for name, kind in vars(Robot).items() if isinstance(kind, property)]
    assert len(numbers) >= 8
    assert all(math.isfinite(number) and number > 0 for number in numbers)


def test_a_robot_file_says_nothing_twice_and_leaves_nothing_out():
    """Every key of the Chefbot's file is needed or has another default; unknown ones were refused."""
    data = yaml.safe_load(TEXT)
    for section in ("body", "wheels", "casters", "motor", "drive", "battery"):
        for key in data[section]:
            with pytest.raises(UserError, match=f"{section}.{key}"):
                load(changed(**{section: {key: None}}))
