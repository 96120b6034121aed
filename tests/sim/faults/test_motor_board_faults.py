"""Tests the faults of a motor board as a whole, and those of its wheels in the physics."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chefbot.design.export.mjcf import PHYSICS_STEP
from chefbot.sim.faults.events import SensorNoise, SensorOffset
from chefbot.sim.faults.motor_board import MotorBoardFaults
from chefbot.sim.faults.wheels import BLOCKING_TORQUE, SHOVE_STEPS, WheelFaults
from chefbot.sim.firmware import imu_scale

BODY = """
<mujoco>
  <option timestep="{step}" gravity="0 0 0"/>
  <worldbody>
    <body name="base_link"><freejoint/><geom type="box" size="0.2 0.2 0.1" mass="8"/>
      <body name="left" pos="0 0.2 0">
        <joint name="left" type="hinge" axis="0 1 0" frictionloss="0.01" armature="0.005"/>
        <geom size="0.05" mass="0.2"/>
      </body>
      <body name="right" pos="0 -0.2 0">
        <joint name="right" type="hinge" axis="0 1 0" frictionloss="0.02" armature="0.005"/>
        <geom size="0.05" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="left"/><motor joint="right"/></actuator>
</mujoco>
"""


def board(seed: int = 1, sent: list[bytes] | None = None) -> MotorBoardFaults:
    """Return the faults of a board that sends `hello` and notes what it is sent."""
    received = [] if sent is None else sent
    firmware: Any = SimpleNamespace(
        write=lambda data: received.append(data) or len(data), read=lambda: b"hello"
    )
    return MotorBoardFaults(firmware, seed)


# The board


def test_without_faults_a_board_is_as_it_is() -> None:
    sent: list[bytes] = []
    faults = board(sent=sent)
    registers = np.arange(7.0)
    assert np.array_equal(faults.imu.apply(registers, 0), registers)
    assert faults.ultrasonic.apply(np.array([1.5]), 0) == [1.5]
    assert faults.encoders.apply((3, -4), 0) == (3, -4)
    assert faults.serial_link.write(b"abc") == 3 and sent == [b"abc"]
    assert faults.serial_link.read() == b"hello"
    assert faults.measured_voltage(11.7) == 11.7


def test_a_wrong_voltage_is_read_whatever_the_battery_has() -> None:
    faults = board()
    faults.wrong_voltage_reading = 12.6
    assert [faults.measured_voltage(voltage) for voltage in (3.0, 11.0)] == [12.6, 12.6]
    faults.wrong_voltage_reading = 0.0
    assert faults.measured_voltage(11.0) == 0.0, "an empty battery, too"
    faults.wrong_voltage_reading = None
    assert faults.measured_voltage(11.0) == 11.0


def test_an_offset_of_the_turn_rate_is_that_in_registers() -> None:
    faults = board()
    faults.imu.set_faults((SensorOffset(at=0.0, sensor="imu", rate=0.5),))
    changed = faults.imu.apply(np.zeros(7), 0)
    assert changed[6] == pytest.approx(0.5 * imu_scale()[1]) and not changed[:6].any()
    faults.ultrasonic.set_faults((SensorOffset(at=0.0, sensor="ultrasonic", range=0.2),))
    assert faults.ultrasonic.apply(np.array([1.0]), 0) == pytest.approx([1.2])


def test_each_sensor_has_noise_of_its_own_by_the_seed() -> None:
    def noisy(seed: int) -> list[float]:
        faults = board(seed)
        for reading, sensor in ((faults.imu, "imu"), (faults.ultrasonic, "ultrasonic")):
            reading.set_faults((SensorNoise(at=0.0, sensor=sensor, share=0.1),))  # type: ignore[arg-type]
        faults.serial_link.bit_errors = 0.5
        imu, echo = faults.imu.apply(np.ones(7), 0)[0], faults.ultrasonic.apply(np.ones(1), 0)[0]
        return [float(imu), float(echo), float(int.from_bytes(faults.serial_link.read()))]

    assert noisy(1) == noisy(1)
    assert all(a != b for a, b in zip(noisy(1), noisy(2), strict=True))
    assert noisy(1)[0] != noisy(1)[1], "the sensors do not share one random stream"


# The wheels


@pytest.fixture
def physics() -> tuple[Any, Any, WheelFaults]:
    model = mujoco.MjModel.from_xml_string(BODY.format(step=PHYSICS_STEP))
    faults = WheelFaults()
    faults.install(model)
    return model, mujoco.MjData(model), faults


def spin(model: Any, data: Any, seconds: float, torque: float = 0.2) -> np.ndarray:
    """Drive both motors; return the speeds of the wheels, rad/s."""
    for _ in range(round(seconds / PHYSICS_STEP)):
        data.ctrl[:] = torque
        mujoco.mj_step(model, data)
    return np.abs(data.qvel[6:8])


@pytest.mark.parametrize("stalled", [(False, False), (True, False), (False, True), (True, True)])
def test_a_blocked_wheel_stands_and_the_other_turns(physics, stalled: tuple[bool, bool]) -> None:
    model, data, faults = physics
    faults.stall(stalled)
    for speed, stands in zip(spin(model, data, 0.3), stalled, strict=True):
        assert speed < 0.1 if stands else speed > 5.0


def test_a_wheel_that_is_free_again_has_its_own_friction(physics) -> None:
    model, data, faults = physics
    before = model.dof_frictionloss.copy()
    faults.stall((True, True))
    assert (model.dof_frictionloss == BLOCKING_TORQUE).sum() == 2
    faults.stall((False, False))
    assert np.array_equal(model.dof_frictionloss, before)
    assert spin(model, data, 0.3).min() > 5.0


def test_blocked_wheels_stay_blocked_in_a_new_model(physics) -> None:
    _, _, faults = physics
    faults.stall((True, False))
    model = mujoco.MjModel.from_xml_string(BODY.format(step=PHYSICS_STEP))
    faults.install(model)
    left, right = spin(model, mujoco.MjData(model), 0.3)
    assert left < 0.1 and right > 5.0


@settings(max_examples=20)
@given(st.floats(0.1, 20.0), st.floats(-math.pi, math.pi))
def test_a_shove_gives_the_robot_its_impulse(impulse: float, direction: float) -> None:
    model = mujoco.MjModel.from_xml_string(BODY.format(step=PHYSICS_STEP))
    data, faults = mujoco.MjData(model), WheelFaults()
    faults.install(model)
    faults.shove(impulse, direction)
    steps = 0
    while faults.shoving:
        faults.shove_once(data)
        mujoco.mj_step(model, data)
        steps += 1
    assert steps == SHOVE_STEPS + 1 and not data.xfrc_applied.any(), "the force ends"
    mass = float(model.body_mass.sum())
    expected = impulse / mass * np.array([math.cos(direction), math.sin(direction)])
    assert data.qvel[:2] == pytest.approx(expected, rel=0.02, abs=1e-4 * impulse)


def test_slipping_wheels_are_remembered_until_written() -> None:
    faults = WheelFaults()
    faults.slip((1.0, 1.0))
    assert not faults.slipped
    faults.slip((0.2, 1.0))
    assert faults.slipped and faults.friction.tolist() == [0.2, 1.0]
    faults.slip((1.0, 1.0))
    assert faults.slipped, "the tyres' friction has to be written once more"
    assert not faults.shoving
