"""Tests the simulated robot: motion, collisions, sensors, doors, people, battery and determinism."""

import math

import msgspec
import numpy as np
import pytest

from chefbot.buildings.people_spec import PeopleSpec
from chefbot.errors import UserError
from chefbot.maths.se2 import SE2
from chefbot.robot.geometry import layout
from chefbot.robot.geometry.layout import CASTER_GAP
from chefbot.robot.load import load_robot
from chefbot.robot.spec import GRAVITY, Robot
from chefbot.sim.battery import SimulatedBattery
from chefbot.sim.people.chairs import TRAVEL
from chefbot.sim.rays import lidar_angles
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.furniture import PERSON_RADIUS
from chefbot.sim.world.world import load_world

ROBOT = load_robot("chefbot_lidar")


def drive_randomly(sim: Simulation, seconds: float, seed: int) -> list[float]:
    """Drive with random duties that change twice a second, and return the tilts in rad."""
    rng, tilts = np.random.default_rng(seed), []
    for _ in range(round(seconds * 2)):
        sim.set_duty(*rng.uniform(-1, 1, 2).tolist())
        for _ in range(100):
            sim.step()
        tilts.append(sim.tilt)
    return tilts


def test_a_minute_of_collisions_neither_tips_nor_diverges() -> None:
    sim = Simulation(ROBOT, load_world("room"), start=SE2(0.9, 0.6, 0.5))
    for seconds in range(6):
        sim.kidnap(SE2(0.9, 0.6, seconds))
        sim.set_duty(1.0, 0.97)
        for _ in range(600):
            sim.step()
        assert max(drive_randomly(sim, 7.0, seconds)) < math.radians(3.0)
    assert sim.time_ns == 60_000_000_000
    assert sim.warnings == 0
    assert math.isfinite(sum(sim.truth().pose))
    assert sim.collisions().episodes > 0


def state_of(sim: Simulation) -> str:
    return repr((sim.truth(), sim.wheel_ticks(), sim.people, sim.battery.charge))


def test_equal_seeds_give_equal_states_and_others_differ() -> None:
    def run(seed: int) -> tuple[str, bytes, bytes]:
        sim = Simulation(ROBOT, load_world("hotel"), "real", seed, people=3)
        drive_randomly(sim, 5.0, 7)
        sim.drop_box(1.0, 1.0, (0.2, 0.2, 0.2))
        drive_randomly(sim, 1.0, 8)
        return state_of(sim), sim.lidar().tobytes(), np.concatenate(sim.imu()).tobytes()

    first = run(1)
    assert run(1) == first
    assert all(a != b for a, b in zip(run(2), first, strict=True))


def test_reading_sensors_does_not_change_the_motion() -> None:
    def run(read: bool) -> str:
        sim = Simulation(ROBOT, load_world("room"), "real", 3, people=1)
        sim.set_duty(0.5, 0.4)
        for _ in range(400):
            sim.step()
            if read:
                sim.lidar(), sim.imu(), sim.ultrasonic(), sim.capture(), sim.truth()
        return state_of(sim)

    assert run(True) == run(False)


def test_duty_is_clamped_to_one_and_must_be_a_number() -> None:
    a, b = (Simulation(ROBOT, load_world("empty")) for _ in range(2))
    a.set_duty(7.0, -7.0)
    b.set_duty(1.0, -1.0)
    for sim in (a, b):
        for _ in range(100):
            sim.step()
    assert state_of(a) == state_of(b)
    with pytest.raises(ValueError, match="finite"):
        a.set_duty(math.nan, 0.0)


def test_ticks_grow_forward_and_match_the_distance() -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    sim.set_duty(0.6, 0.6)
    for _ in range(1000):
        sim.step()
    left, right = sim.wheel_ticks()
    assert left == pytest.approx(sim.truth().pose.x / ROBOT.metres_per_tick, rel=0.01)
    assert abs(left - right) <= 1
    assert sim.truth().v > 0.1
    sim.set_duty(-0.6, 0.6)
    for _ in range(400):
        sim.step()
    assert sim.truth().w > 0.5  # a faster right wheel turns to the left


def test_imu_reads_gravity_at_rest_and_the_rate_in_a_turn() -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    for _ in range(200):
        sim.step()
    gyro, force = sim.imu()
    rest = 1.05 * GRAVITY * CASTER_GAP / ROBOT.casters.offset  # it rests on the caster of the heavier side
    assert force == pytest.approx([0.0, 0.0, GRAVITY], abs=rest)
    assert gyro == pytest.approx([0.0, 0.0, 0.0], abs=0.005)
    sim.set_duty(-0.3, 0.3)
    for _ in range(400):
        sim.step()
    assert sim.imu()[0][2] == pytest.approx(sim.truth().w, abs=0.01)


def test_real_imu_has_robot_noise_and_a_constant_bias() -> None:
    sim = Simulation(ROBOT, load_world("empty"), "real", 5)
    for _ in range(400):
        sim.step()
    readings = np.array([np.concatenate(sim.imu()) for _ in range(4000)])
    imu = ROBOT.sensors.imu
    assert readings[:, :3].std(axis=0) == pytest.approx([imu.gyro_noise] * 3, rel=0.1)
    assert readings[:, 3:].std(axis=0) == pytest.approx([imu.accelerometer_noise] * 3, rel=0.1)
    bias = readings[:, :3].mean(axis=0)
    assert 0.0 < np.abs(bias).max() < 4 * imu.gyro_bias + 0.002


def test_lidar_and_ultrasonic_measure_the_true_wall_distance() -> None:
    sim = Simulation(ROBOT, load_world("room"))
    lidar, ranger = ROBOT.sensors.lidar, ROBOT.sensors.ultrasonic
    assert lidar is not None and ranger is not None
    ranges = sim.lidar()
    assert ranges.shape == (lidar.beams,)
    for bearing, wall in ((0.0, 3.94), (-math.pi, 0.94), (math.pi / 2, 1.94)):
        beam = int(np.argmin(np.abs(lidar_angles(lidar) - bearing)))
        sensor = lidar.mount.x if bearing == 0.0 else -lidar.mount.x if bearing < 0 else 0.0
        assert ranges[beam] == pytest.approx(wall - sensor, abs=0.005)
    assert sim.ultrasonic() < 3.94 - ranger.mount.x + 0.01
    sim.kidnap(SE2(2.9, -0.3, -math.pi / 2))
    assert 0.9 < sim.ultrasonic() <= 1.94 - 0.3 - ranger.mount.x + 0.01


def test_ranges_out_of_bounds_are_infinite_with_their_sign() -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    assert np.isposinf(np.abs(sim.lidar())).all()
    assert np.isposinf(sim.lidar()[180])
    assert sim.ultrasonic() == math.inf
    near = Simulation(robot_with_lidar(range_min=0.3), load_world("empty"))
    near.drop_box(0.4, 0.0, (0.4, 0.6, 0.6))
    assert np.isneginf(near.lidar()[180])
    assert near.ultrasonic() == pytest.approx(0.2 - 0.14, abs=0.002)


def robot_with_lidar(z: float = 0.2, range_min: float = 0.12) -> Robot:
    replace = msgspec.structs.replace
    lidar = ROBOT.sensors.lidar
    assert lidar is not None
    lidar = replace(lidar, mount=replace(lidar.mount, z=z), range_min=range_min)
    return replace(ROBOT, sensors=replace(ROBOT.sensors, lidar=lidar))


def test_a_wall_contact_counts_as_one_collision() -> None:
    sim = Simulation(ROBOT, load_world("room"), start=SE2(0.0, -0.4, math.pi))
    sim.set_duty(0.6, 0.6)
    touched = set()
    for _ in range(1500):
        sim.step()
        touched.add(sim.touching)
    assert sim.collisions() == (1, ("wall_3",))
    assert touched == {(), ("wall_3",)}  # slipping wheels interrupt the contact, which is still one episode
    for _ in range(2):
        sim.set_duty(-0.5, -0.5)
        for _ in range(400):
            sim.step()
        assert sim.touching == ()
        sim.set_duty(0.6, 0.6)
        for _ in range(800):
            sim.step()
    assert sim.collisions().episodes == 3


def test_free_driving_has_no_collision() -> None:
    sim = Simulation(ROBOT, load_world("room"))
    sim.set_duty(-0.5, 0.5)
    for _ in range(1000):
        sim.step()
    assert sim.collisions() == (0, ())


def test_dropping_a_box_keeps_the_motion_and_stops_the_robot() -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    sim.set_duty(0.6, 0.6)
    for _ in range(200):
        sim.step()
    before = sim.truth()
    name = sim.drop_box(before.pose.x + 0.8, 0.0, (0.3, 0.6, 0.3))
    assert sim.truth() == before
    for _ in range(1500):
        sim.step()
    assert sim.collisions().names == (name,)
    assert sim.truth().pose.x < before.pose.x + 0.8 - 0.15 - 0.14
    with pytest.raises(UserError, match="would fall on"):
        sim.drop_box(sim.truth().pose.x, 0.0, (0.3, 0.3, 0.3))


def test_kidnap_moves_the_robot_not_the_wheels() -> None:
    sim = Simulation(ROBOT, load_world("room"))
    sim.set_duty(0.5, 0.5)
    for _ in range(200):
        sim.step()
    ticks = sim.wheel_ticks()
    sim.kidnap(SE2(0.9, 0.6, 2.0))
    assert sim.truth().pose == pytest.approx((0.9, 0.6, 2.0))
    assert sim.wheel_ticks() == ticks
    with pytest.raises(UserError, match="overlaps cupboard"):
        sim.kidnap(SE2(3.7, -1.4, 0.0))
    with pytest.raises(UserError, match="finite"):
        sim.kidnap(SE2(math.nan, 0.0, 0.0))


@pytest.mark.parametrize(
    "box", [(math.nan, 0.0, 0.2), (0.0, 1e9, 0.2), (1.0, 1.0, -0.2), (1.0, 1.0, math.nan)]
)
def test_impossible_boxes_are_rejected(box: tuple[float, float, float]) -> None:
    sim = Simulation(ROBOT, load_world("empty"))
    with pytest.raises(UserError, match="a box of"):
        sim.drop_box(box[0], box[1], (box[2], 0.2, 0.2))


def test_doors_close_in_two_seconds_and_not_on_the_robot() -> None:
    sim = Simulation(ROBOT, load_world("hotel"), start=SE2(2.0, 1.2, 0.0))
    assert sim.lidar()[180] > 2.0  # through the open kitchen door
    sim.set_door("kitchen_door", 0.0)
    for _ in range(410):
        sim.step()
    assert sim.doors()["kitchen_door"] == pytest.approx(0.0)
    assert sim.lidar()[180] == pytest.approx(1.08, abs=0.03)
    sim.set_door("kitchen_door", 1.0)
    for _ in range(410):
        sim.step()
    sim.kidnap(SE2(3.1, 1.2, 0.0))
    sim.set_door("kitchen_door", 0.0)
    for _ in range(800):
        sim.step()
    assert 0.2 < sim.doors()["kitchen_door"] < 0.8
    assert sim.collisions().episodes == 0
    with pytest.raises(UserError, match="did you mean 'kitchen_door'"):
        sim.set_door("kitchen_dor", 0.5)


@pytest.mark.slow
def test_people_walk_and_keep_their_distance_to_the_robot() -> None:
    sim = Simulation(ROBOT, load_world("hotel"), seed=4, people=6, start=SE2(6.45, 6.2, 0.0))
    start, min_distance, walked = sim.people, math.inf, 0.0
    for _ in range(6000):
        sim.step()
        min_distance = min(min_distance, *(person.distance(sim.truth().pose) for person in sim.people))
        walked = max(walked, *(a.distance(b) for a, b in zip(start, sim.people, strict=True)))
    assert walked > 2.0
    assert min_distance > 0.4
    assert sim.collisions().episodes == 0


def test_more_people_than_space_are_rejected() -> None:
    with pytest.raises(UserError, match="no room for person"):
        Simulation(ROBOT, load_world("room"), people=40)
    assert len(Simulation(ROBOT, load_world("empty"), people=1).people) == 1


def test_people_who_do_not_avoid_the_robot_do_not_move_it() -> None:
    spec = PeopleSpec(count=8, avoid_robot=False, block=0.5, follow=0.5)
    sim = Simulation(ROBOT, load_world("room"), seed=3, people=spec)
    start = sim.truth().pose
    nearest = math.inf
    for _ in range(6000):
        sim.step()
        nearest = min(nearest, *(person.distance(start) for person in sim.people))
    assert nearest < ROBOT.circumscribed_radius + PERSON_RADIUS + 0.6
    assert sim.truth().pose.distance(start) < 0.001
    assert sim.collisions() == (0, ()) and sim.warnings == 0


def test_driving_into_a_person_is_a_collision() -> None:
    spec = PeopleSpec(count=1, avoid_robot=False, stand_and_talk=1.0)
    sim = Simulation(ROBOT, load_world("empty"), seed=1, people=spec)
    person = sim.people[0]
    sim.kidnap(SE2(person.x - 0.8, person.y, 0.0))
    for _ in range(1000):
        sim.set_duty(0.5, 0.5)
        sim.step()
        if sim.collisions().episodes:
            break
    assert sim.collisions().names == ("person_0",) and sim.warnings == 0


def test_sensors_see_chairs_where_people_pulled_them() -> None:
    spec = PeopleSpec(count=2, pull_chairs=1.0)
    sim = Simulation(load_robot("chefbot"), load_world("hotel"), seed=1, people=spec)
    chairs = sim.movers._people.movable  # type: ignore[union-attr]
    assert chairs and not {shape.name for chair in chairs for shape in chair.solids} & {
        shape.name for shape in sim.movers.fixed
    }
    chair = chairs[0]
    chair.target, home = TRAVEL, chair.pose
    for _ in range(600):
        sim.step()
    assert chair.pose.distance(home) > 0.1
    seat = next(shape for shape in chair.shapes if shape.name.endswith("/seat")).transformed(chair.pose)
    centres = sim.capture().shapes.centre
    assert np.hypot(*(centres[:, :2] - (seat.x, seat.y)).T).min() < 1e-6
    body = sim._data.body(f"world/{chair.name}")
    assert body.xpos[:2] == pytest.approx([chair.pose.x, chair.pose.y])


def test_a_start_inside_furniture_is_rejected() -> None:
    with pytest.raises(UserError, match=r"start.*overlaps cupboard"):
        Simulation(ROBOT, load_world("room"), start=SE2(3.4, -1.4, 0.0))


def test_battery_lasts_for_its_charge_and_sags_under_load() -> None:
    battery = SimulatedBattery(ROBOT)
    resting = battery.voltage
    battery.drain((1.0, 1.0), (1.0, 1.0), 1.0)
    assert battery.voltage < resting < ROBOT.battery.full_voltage
    hours = 0
    battery = SimulatedBattery(ROBOT)
    while battery.voltage > 0.0:
        battery.drain((0.0, 0.0), (0.0, 0.0), 36.0)
        hours += 36
    energy = ROBOT.battery.capacity * (ROBOT.battery.full_voltage + ROBOT.battery.empty_voltage) / 2
    assert hours == pytest.approx(energy / ROBOT.power.electronics, rel=0.02)
    assert (battery.charge, battery.current) == (0.0, 0.0)


def test_an_empty_battery_stops_the_robot() -> None:
    sim, resting = (Simulation(ROBOT, load_world("empty")) for _ in range(2))
    sim.battery.charge = 0.0
    sim.battery.drain((0.0, 0.0), (0.0, 0.0), 0.0)
    sim.set_duty(1.0, 1.0)
    for _ in range(400):
        sim.step()
        resting.step()
    assert sim.truth() == resting.truth()  # both only settle on a caster


def test_the_tubes_hide_beams_of_the_lidar() -> None:
    sim = Simulation(ROBOT, load_world("room"))
    lidar = ROBOT.sensors.lidar
    assert lidar is not None
    at = np.array(layout.pole_positions(ROBOT)) - (lidar.mount.x, lidar.mount.y)
    half = np.arcsin((ROBOT.tubes.bore / 2 + ROBOT.tubes.wall) / np.hypot(*at.T))
    turn = np.exp(1j * lidar_angles(lidar))[:, None] / (at @ (1.0, 1j))
    off = np.abs(np.angle(turn)) - half
    hidden = np.isneginf(sim.lidar())
    assert hidden[(off < -0.001).any(axis=1)].all()
    assert not hidden[(off > 0.001).all(axis=1)].any()
