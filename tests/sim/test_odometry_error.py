"""Tests that `odometry_error` scales what odometry suffers from, and that 1 is the profile as it is."""

from __future__ import annotations

import pytest
from tests.sim.board_drive import ROBOT

from chefbot.robot.as_built import AS_DRAWN, AsBuilt
from chefbot.sim.simulation import Simulation
from chefbot.sim.world.world import load_world


def built(odometry_error: float, profile: str = "real", seed: int = 3) -> Simulation:
    return Simulation(ROBOT, load_world("empty"), profile, seed, odometry_error=odometry_error)  # type: ignore[arg-type]


def deviations(as_built: AsBuilt) -> list[float]:
    return [as_built.left_wheel - 1.0, as_built.right_wheel - 1.0, as_built.separation - 1.0]


def test_zero_is_the_robot_as_drawn_on_an_even_floor() -> None:
    sim = built(0.0)
    assert sim.as_built == AS_DRAWN and sim.gyro_scale == 1.0 and not sim.gyro_offset.any()
    assert {sim._grip.factor(x, 0.3) for x in (0.0, 1.0, 2.5)} == {1.0}


def test_one_is_the_profile_as_it_is() -> None:
    for profile in ("real", "assembled"):
        default = Simulation(ROBOT, load_world("empty"), profile, 3)  # type: ignore[arg-type]
        same = built(1.0, profile)
        assert default.as_built == same.as_built and default.gyro_scale == same.gyro_scale
        assert (default.gyro_offset == same.gyro_offset).all()


@pytest.mark.parametrize("factor", [0.5, 2.0, 10.0])
def test_deviations_grow_in_proportion(factor: float) -> None:
    one, scaled = built(1.0), built(factor)
    expected = [factor * value for value in deviations(one.as_built)]
    assert deviations(scaled.as_built) == pytest.approx(expected, rel=1e-9)
    assert scaled.gyro_scale - 1.0 == pytest.approx(factor * (one.gyro_scale - 1.0))
    assert scaled.gyro_offset == pytest.approx(factor * one.gyro_offset)


def test_the_worst_floor_still_has_friction() -> None:
    for seed in range(20):
        sim = built(10.0, seed=seed)
        assert sim.as_built.friction >= 0.1
        assert min(sim._grip.factor(x / 5, 0.0) for x in range(50)) >= 0.1 - 1e-9


def test_sensors_that_odometry_does_not_use_stay_the_same() -> None:
    one, ten = built(1.0, "assembled"), built(10.0, "assembled")
    assert (one.as_built.lidar_yaw, one.as_built.camera_yaw) == (
        ten.as_built.lidar_yaw,
        ten.as_built.camera_yaw,
    )
