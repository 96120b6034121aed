"""Tests the firmware in the simulated robot: motion, messages, and stops when commands or the computer fail."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from tests.sim.board_drive import ROBOT, SECOND, DeadReckoningDriver, drive, robot_in

from chefbot.board.messages import InertiaLine, MotionLine
from chefbot.board.status_codes import BoardFlag
from chefbot.control.kinematics import wheel_speeds
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import BatteryState, Imu, Range
from chefbot.robot.motion_limits import max_acceleration, max_speed
from chefbot.robot.spec import GRAVITY
from chefbot.sim.board import EXCHANGE_PERIOD_NS, SimulatedBoard
from chefbot.sim.firmware import BUILDER, CONTROL_NS, LIBRARY, Firmware, library
from chefbot.sim.motor_board import SimulatedMotorBoard
from chefbot.sim.simulation import STEP_NS, Simulation
from chefbot.sim.world.world import load_world

# -- UMBmark with the board's ticks alone


def square_error(profile: str, seed: int, side: float, sign: float) -> float:
    """Drive a square by odometry and return the distance between odometry and truth at its end, metres."""
    sim, board = robot_in("empty", profile, seed)
    origin, driver = sim.truth().pose, DeadReckoningDriver(sim, board)
    for x, y in ((side, 0.0), (side, sign * side), (0.0, sign * side), (0.0, 0.0)):
        driver.turn_to(math.atan2(y - driver.pose.y, x - driver.pose.x))
        driver.drive_to(x, y)
    assert driver.pose.distance(SE2(0.0, 0.0, 0.0)) < 0.03  # the square was driven
    assert sim.warnings == 0
    return origin.between(sim.truth().pose).distance(driver.pose)


@pytest.mark.rotated("squares of simulated robots")
@pytest.mark.parametrize("sign", [1.0, pytest.param(-1.0, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_perfect_odometry_closes_a_ten_metre_square(sign: float) -> None:
    assert square_error("perfect", 0, 10.0, sign) < 0.02


@pytest.mark.rotated("squares of simulated robots")
@pytest.mark.slow
def test_simulated_real_robots_deviate_individually() -> None:
    errors = [square_error("real", seed, 2.0, 1.0) for seed in (1, 2)]
    assert min(errors) > 2 * square_error("perfect", 0, 2.0, 1.0)
    assert errors[0] != errors[1]
    for seed in range(20):
        built = Simulation(ROBOT, load_world("empty"), "real", seed).as_built
        mean, difference = (built.left_wheel + built.right_wheel) / 2, built.right_wheel - built.left_wheel
        for error in (mean - 1.0, difference, built.separation - 1.0):
            assert 0.00199 <= abs(error) <= 0.00501


# -- motion


@pytest.mark.parametrize("name", ["chefbot", "chefbot_lidar", "porter"])
def test_the_board_holds_the_commanded_speed(name: str) -> None:
    sim, board = robot_in("empty", "perfect", 0, name)
    drive(board, max_speed(sim.robot), max_speed(sim.robot), 4.0)
    assert sim.truth().v == pytest.approx(max_speed(sim.robot), rel=0.03)
    assert abs(sim.truth().pose.y) < 0.002
    drive(board, -0.05, 0.05, 3.0)
    assert sim.truth().w == pytest.approx(0.1 / sim.robot.wheels.separation, rel=0.03)


def test_acceleration_is_limited_as_in_the_robot_file() -> None:
    sim, board = robot_in("empty")
    expected, before = max_acceleration(ROBOT) / ROBOT.metres_per_tick / 100, 0
    start = sim.truth().v
    for step in range(25):
        if step % 5 == 0:
            board.command(*wheel_speeds(max_speed(ROBOT), 0.0, ROBOT))
        board.motors.run_until(sim.time_ns + 10_000_000)
        assert board.motors.state.set[0] - before == pytest.approx(expected, abs=1.0)
        before = board.motors.state.set[0]
    assert (sim.truth().v - start) / 0.25 == pytest.approx(max_acceleration(ROBOT), rel=0.2)


@pytest.mark.parametrize("name", ["chefbot", "chefbot_lidar", "porter"])
@pytest.mark.parametrize("profile", ["perfect", "real"])
def test_a_dead_computer_stops_the_robot(name: str, profile: str) -> None:
    """After full speed the wheels' command is zero within 200 ms, and the robot stops within 0.25 m."""
    sim, board = robot_in("empty", profile, 3, name)
    drive(board, max_speed(sim.robot), max_speed(sim.robot), 3.0)
    board.motors.write(board.link.data_to_send(board.now_ns))  # the last bytes of the computer
    began, start = sim.time_ns, sim.truth().pose
    assert sim.truth().v > 0.9 * max_speed(sim.robot)
    while board.motors.state.duty[0] or board.motors.state.duty[1] or board.motors.state.set[0]:
        board.motors.run_until(sim.time_ns + 10_000_000)
    assert sim.time_ns - began <= 200_000_000
    board.motors.run_until(sim.time_ns + SECOND)
    assert start.distance(sim.truth().pose) < 0.25
    assert abs(sim.truth().v) < 0.002
    board.motors.run_until(sim.time_ns + SECOND)
    assert not board.motors.state.drivers


@pytest.mark.parametrize("pause_ms", [10, 30, 50])
def test_silent_nodes_stop_the_robot_while_the_driver_runs(pause_ms: int) -> None:
    """The wheels' command is zero 200 ms after the last command, although the driver continues to send."""
    sim, board = robot_in("empty", "perfect", 0, "chefbot")
    drive(board, max_speed(sim.robot), max_speed(sim.robot), 3.0)
    board.run_until(board.now_ns + pause_ms * 1_000_000)
    board.command(*wheel_speeds(max_speed(sim.robot), 0.0, sim.robot))
    began, start = board.now_ns, sim.truth().pose
    while any(board.motors.state.duty):
        board.run_until(board.now_ns + 10_000_000)
    assert board.now_ns - began <= 200_000_000
    board.run_until(board.now_ns + 2 * SECOND)
    assert start.distance(sim.truth().pose) < 0.25
    assert board.link.session.is_open


def test_half_a_command_moves_nothing() -> None:
    sim, board = robot_in("empty")
    start = sim.truth().pose
    for cut in (2, 5, 12):
        board.motors.write(board.link.command(6.0, 6.0, board.now_ns)[:-cut] + b"\n")
        board.motors.run_until(sim.time_ns + SECOND // 2)
    assert start.distance(sim.truth().pose) < 0.001
    assert board.motors.state.refused == 3


def test_emergency_stop_holds_until_clear_and_a_zero_command() -> None:
    sim, board = robot_in("empty")
    drive(board, 0.3, 0.3, 1.0)
    board.stop()
    drive(board, 0.3, 0.3, 0.5)
    assert abs(sim.truth().v) < 0.002
    assert board.motors.state.flags & BoardFlag.ESTOP_COMMAND
    board.clear()
    drive(board, 0.3, 0.3, 1.0)  # a command from before the stop
    assert abs(sim.truth().v) < 0.002
    drive(board, 0.0, 0.0, 0.3)
    drive(board, 0.3, 0.3, 1.0)
    assert sim.truth().v > 0.25


def test_a_blocked_robot_switches_its_motors_off() -> None:
    sim, board = robot_in("empty")
    sim.drop_box(0.5, 0.0, (0.2, 2.0, 0.5))
    sim._model.geom_friction[sim._wheels, 0] = 5.0  # so that no wheel slips
    drive(board, max_speed(ROBOT), max_speed(ROBOT), 6.0)
    assert board.motors.state.flags & (BoardFlag.STALL_LEFT | BoardFlag.STALL_RIGHT | BoardFlag.ENCODER_LEFT)
    assert list(board.motors.state.duty) == [0, 0]
    assert "wheel" in board.link.report("simulated", board.now_ns).message


# -- motors


def coast(drivers: bool) -> float:
    """Return the distance that the robot rolls from 0.3 m/s without duty, metres."""
    sim = Simulation(ROBOT, load_world("empty"))
    sim.set_duty(0.6, 0.6)
    for _ in range(400):
        sim.step()
    start = sim.truth().pose
    sim.set_duty(0.0, 0.0)
    sim.set_drivers(drivers)
    for _ in range(400):
        sim.step()
    return start.distance(sim.truth().pose)


def test_shorted_motors_brake_and_open_ones_roll() -> None:
    assert 1.5 * coast(drivers=True) < coast(drivers=False) < 0.5


def test_an_unloaded_motor_matches_its_data_sheet() -> None:
    """The model has no-load speed and current, stall torque and stall current at the rated voltage."""
    sim = Simulation(ROBOT, load_world("empty"))
    motor, motors = ROBOT.motor, sim._motors
    gain = sim._model.actuator_gainprm[0, 0]
    slope = -sim._model.actuator_biasprm[0, 2]
    at_speed = gain - slope * motor.no_load_speed
    assert at_speed == pytest.approx(motors.friction)  # no torque is left for a load
    assert motors.currents((at_speed, at_speed))[0] == pytest.approx(motor.no_load_current)
    assert motors.currents((gain, gain))[0] == pytest.approx(motor.stall_current)


# -- messages


def test_board_messages_match_the_simulation_state() -> None:
    sim, board = robot_in("room")
    messages = drive(board, 0.0, 0.0, 0.5) + drive(board, 0.1, 0.2, 1.5)
    last = {type(message): message for message in messages}
    ticks, imu = last[WheelTicks], last[Imu]
    assert isinstance(ticks, WheelTicks) and isinstance(imu, Imu)
    assert (ticks.left, ticks.right) == sim.wheel_ticks()
    assert ticks.header.stamp.ns == board.now_ns
    assert imu.angular_velocity.z == pytest.approx(sim.truth().w, abs=0.01)
    assert imu.linear_acceleration.z == pytest.approx(GRAVITY, abs=0.3)
    messages = drive(board, 0.0, 0.0, 3.0)
    battery = [message for message in messages if isinstance(message, BatteryState)][-1]
    assert battery.voltage == pytest.approx(sim.battery.voltage, abs=0.01)
    echo = [message for message in messages if isinstance(message, Range)][-1]
    assert echo.range == pytest.approx(sim.ultrasonic(), abs=0.005)
    rates = [message.angular_velocity.z for message in messages[-50:] if isinstance(message, Imu)]
    assert np.abs(rates).max() < 0.001


def test_message_rates_match_the_protocol() -> None:
    _, board = robot_in("empty", "real", 4)
    kinds = [type(message) for message in drive(board, 0.1, 0.1, 10.0)]
    sonar = ROBOT.sensors.ultrasonic
    assert sonar is not None
    assert (kinds.count(WheelTicks), kinds.count(Imu)) == (500, 500)
    assert kinds.count(BatteryState) == 20
    assert kinds.count(Range) == round(10 * sonar.rate)
    assert board.link.session.damaged == board.link.session.stream.lost == 0


def test_range_without_echo_is_inf_and_in_contact_minus_inf() -> None:
    sim, board = robot_in("empty")
    far = [m.range for m in drive(board, 0.0, 0.0, 0.5) if isinstance(m, Range)]
    assert far == [math.inf] * len(far) != []
    sim.drop_box(0.352, 0.0, (0.4, 0.6, 0.6))
    near = [m.range for m in drive(board, 0.0, 0.0, 0.5) if isinstance(m, Range)]
    assert near[-1] == -math.inf


def test_the_imu_has_the_resolution_and_noise_of_the_robot() -> None:
    sim, board = robot_in("empty", "real", 5)
    motion, inertia = [], []
    for _ in range(1000):
        board.motors.run_until(sim.time_ns + EXCHANGE_PERIOD_NS)
        for received in board.link.session.receive_data(board.motors.read(), board.now_ns):
            (motion if isinstance(received.line, MotionLine) else inertia).append(received.line)
    rates = np.array([line.gz for line in inertia if isinstance(line, InertiaLine)]) * 1e-6
    lsb = math.radians(1.0) / 65.5
    assert np.abs(rates / lsb - np.rint(rates / lsb)).max() < 0.02
    assert rates.std() == pytest.approx(ROBOT.sensors.imu.gyro_noise, rel=0.15)
    angle = (motion[-1].angle - motion[0].angle) * 1e-8
    mean = angle / ((motion[-1].t - motion[0].t) * 1e-6)
    assert mean == pytest.approx(rates.mean(), abs=5 * ROBOT.sensors.imu.gyro_noise / math.sqrt(1000))


def test_a_spin_beyond_the_gyro_range_is_flagged() -> None:
    board = Firmware(ROBOT)
    board.imu[:] = (0, 0, 8192, -3920, 0, 0, 32767)
    flags = []
    for temperature in range(40):
        board.imu[3] = temperature
        board.step((0, 0), 13000)
        flags.append(board.state.flags)
    assert flags[-1] & BoardFlag.IMU_BAD


def test_an_exchange_takes_place_once_per_period(monkeypatch: pytest.MonkeyPatch) -> None:
    board = SimulatedBoard(ROBOT, Simulation(ROBOT, load_world("empty")), start_ns=1)
    exchanged: list[int] = []
    receive = board.link.receive_data
    monkeypatch.setattr(
        board.link, "receive_data", lambda data, now: exchanged.append(now) or receive(data, now)
    )
    for n in range(1, 51):
        board.run_until(n * EXCHANGE_PERIOD_NS)
    assert np.diff(exchanged).tolist() == [EXCHANGE_PERIOD_NS] * (len(exchanged) - 1)


# -- determinism


def test_the_same_seed_gives_identical_bytes() -> None:
    def bytes_of(seed: int) -> tuple[bytes, str]:
        sim = Simulation(ROBOT, load_world("room"), "real", seed)
        board = SimulatedBoard(ROBOT, sim)
        sent = b""
        for step in range(60):
            board.command(2.0, 2.0 + 0.04 * step)
            board.motors.write(board.link.data_to_send(board.now_ns))
            board.motors.run_until(sim.time_ns + EXCHANGE_PERIOD_NS)
            sent += (part := board.motors.read())
            board.link.receive_data(part, board.now_ns)
        return sent, repr((sim.truth(), sim.wheel_ticks(), sim.battery.charge))

    first = bytes_of(1)
    assert bytes_of(1) == first
    assert bytes_of(2)[0] != first[0] != b""


def test_the_step_size_makes_no_difference() -> None:
    """The board runs in whole control steps: steps of 3 ms and of a second give the same lines."""

    def lines(pieces: int) -> bytes:
        sim = Simulation(ROBOT, load_world("empty"), "real", 2)
        board = SimulatedMotorBoard(ROBOT, sim)
        sent = b""
        for end in np.linspace(0, SECOND, pieces + 1)[1:]:
            board.run_until(int(end))
            sent += board.read()
        return sent

    assert lines(1) == lines(333)


def test_the_library_is_built_from_this_checkout() -> None:
    library()
    if not BUILDER.exists():
        pytest.skip("an installed package has no sources beside it")
    import runpy

    assert runpy.run_path(str(BUILDER))["fingerprint"]().encode() in LIBRARY.read_bytes()


def test_constants_out_of_firmware_range_are_rejected() -> None:
    motor = msgspec.structs.replace(ROBOT.motor, no_load_speed=1e-6)
    with pytest.raises(RuntimeError, match="rejects the constants"):
        Firmware(msgspec.structs.replace(ROBOT, motor=motor))


def test_the_control_period_is_a_multiple_of_the_physics_step() -> None:
    assert CONTROL_NS % STEP_NS == 0
