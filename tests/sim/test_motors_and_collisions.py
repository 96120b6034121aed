"""Tests the motor model, the collision monitor and the shading of rendered images."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from chefbot.design.export.mjcf import HULL_GROUP
from chefbot.robot.load import load_robot
from chefbot.robot.spec import DRIVE_EFFICIENCY
from chefbot.sim.cameras.shading import AMBIENT, DIFFUSE, LIGHT, box_normal, lambert
from chefbot.sim.contacts import EPISODE_GAP_NS, ContactMonitor
from chefbot.sim.motors import Motors, enable_drivers
from chefbot.sim.world.shapes import BOX, CAPSULE, CYLINDER
from chefbot.sim.world.world_mjcf import PREFIX

ROBOT = load_robot("chefbot")
STANDING, DRIVING = np.zeros(8), np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.1, 5.0, 5.0])


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_currents_are_proportional_to_the_torque(left: float, right: float) -> None:
    motors = Motors.of(ROBOT)
    amperes = motors.currents((left, right))
    assert np.array(amperes) * motors.torque_per_ampere == pytest.approx([left, right])


def test_data_sheet_points_are_on_the_model() -> None:
    motors, motor = Motors.of(ROBOT), ROBOT.motor
    stall = DRIVE_EFFICIENCY * motor.stall_torque + motors.friction
    assert motors.currents((stall, motors.friction)) == pytest.approx(
        (motor.stall_current, motor.no_load_current)
    )


def test_drivers_switch_the_actuators() -> None:
    model = SimpleNamespace(opt=SimpleNamespace(disableactuator=0))
    enable_drivers(model, False)
    assert model.opt.disableactuator
    enable_drivers(model, True)
    assert not model.opt.disableactuator


def monitor() -> ContactMonitor:
    """Return a monitor for the geoms 0 floor, 1 robot, 2 and 3 parts of a chair, 4 a wall, 5 a person."""
    names = ["floor", "base", *(PREFIX + n for n in ("chair/leg", "chair/seat", "wall", "person_0/trunk"))]
    model = SimpleNamespace(
        ngeom=6,
        geom=lambda key: SimpleNamespace(id=0) if key == "floor" else SimpleNamespace(name=names[key]),
        geom_group=np.array([0, HULL_GROUP, 0, 0, 0, 0]),
    )
    collision_monitor = ContactMonitor()
    collision_monitor.watch(model)
    return collision_monitor


def test_contacts_of_one_object_are_one_episode() -> None:
    contacts = monitor()
    for ms in range(0, 1000, 100):
        contacts.update(np.array([[1, 2], [3, 1], [0, 1]]), DRIVING, ms * 1_000_000)
    assert contacts.collisions == (1, ("chair",)) and contacts.touching == ("chair",)


def test_the_floor_and_contacts_between_objects_do_not_count() -> None:
    contacts = monitor()
    contacts.update(np.array([[0, 1], [2, 4], [0, 2]]), DRIVING, 0)
    assert contacts.collisions.episodes == 0 and contacts.touching == ()


@given(st.lists(st.integers(1, 2_000_000_000), min_size=1, max_size=20))
def test_an_episode_begins_after_a_gap_without_contact(gaps: list[int]) -> None:
    contacts, now = monitor(), 0
    contacts.update(np.array([[1, 4]]), STANDING, 0)
    for gap in gaps:
        now += gap
        contacts.update(np.empty((0, 2), np.int32), STANDING, now - 1)
        contacts.update(np.array([[4, 1]]), STANDING, now)
    assert contacts.collisions.episodes == 1 + sum(gap > EPISODE_GAP_NS for gap in gaps)


def test_who_walks_into_a_standing_robot_is_left_out() -> None:
    contacts = monitor()
    for ms in range(0, 900, 100):
        contacts.update(np.array([[1, 5]]), STANDING if ms < 200 else DRIVING, ms * 1_000_000)
    assert contacts.collisions == (0, ()) and contacts.touching == ("person_0",)
    contacts.update(np.array([[5, 1]]), DRIVING, 3_000_000_000)
    contacts.update(np.array([[5, 1]]), STANDING, 3_100_000_000)
    assert contacts.collisions == (1, ("person_0",))


@given(st.integers(0, 2), st.booleans(), st.floats(-0.99, 0.99), st.floats(-0.99, 0.99))
def test_the_normal_of_a_box_face_points_outwards(
    axis: int, positive: bool, first: float, second: float
) -> None:
    half = np.array([0.3, 0.5, 0.7])
    point = np.insert(np.array([first, second]), axis, 1.0 if positive else -1.0) * half
    normal = np.array(box_normal(half, *point))
    assert np.array_equal(normal, np.eye(3)[axis] * (1.0 if positive else -1.0))


@given(st.sampled_from([BOX, CYLINDER, CAPSULE]), st.floats(-3.0, 3.0), st.floats(-3.1, 3.1))
def test_brightness_is_bounded_by_ambient_and_full_light(kind: int, z: float, angle: float) -> None:
    half = np.array([0.4, 0.4, 0.9])
    height = z * 0.9
    radius = 0.4 if abs(height) < 0.9 else 0.2
    point = np.array([radius * math.cos(angle), radius * math.sin(angle), height])
    assume(abs(abs(height) - 0.9) > 1e-3)
    strength = float(np.linalg.norm(LIGHT))
    light = lambert(kind, np.zeros(3), half, 0.3, point)
    assert AMBIENT + DIFFUSE * (0.5 - 0.5 * strength) - 1e-9 <= light
    assert light <= AMBIENT + DIFFUSE * (0.5 + 0.5 * strength) + 1e-9


def test_a_side_towards_the_light_is_brighter() -> None:
    half = np.array([0.4, 0.4, 0.9])
    towards, away = (np.array([s * 0.4, 0.0, 0.1]) for s in (1.0, -1.0))
    for kind in (BOX, CYLINDER, CAPSULE):
        assert lambert(kind, np.zeros(3), half, 0.0, towards) > lambert(kind, np.zeros(3), half, 0.0, away)
