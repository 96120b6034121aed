"""Tests that the odometry noise of mapping and localization has the meaning of the code of gmapping and AMCL."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest

from chefbot.config import ConfigError, build
from chefbot.localization import odometry_motion
from chefbot.localization.params import AmclParams
from chefbot.maths.odometry_noise import OdometryNoise
from chefbot.maths.se2 import SE2
from chefbot.nodes.gmapping import GmappingNodeParams
from chefbot.slam.motion_model import OdometryStep
from chefbot.slam.params import GmappingParams

SAMPLES = 200_000


def noise_of(keys: dict[str, float], square_root: bool = False) -> OdometryNoise:
    """Return the odometry noise for the parameters of a ROS package."""
    values = {OdometryNoise.ROS_KEYS[key][0]: value for key, value in keys.items()}
    return build(
        {key: math.sqrt(x) if square_root else x for key, x in values.items()}, OdometryNoise, "noise"
    )


@pytest.mark.parametrize(
    "motion", [SE2(0.8, 0.0, 0.0), SE2(0.0, 0.0, 0.9), SE2(0.6, -0.2, 0.5), SE2(-0.3, 0.1, -1.0)]
)
def test_gmappings_keys_mean_what_its_code_samples(motion: SE2) -> None:
    srr, str_, srt, stt = 0.11, 0.03, 0.17, 0.23
    rng = np.random.default_rng(7)
    x, y, yaw = abs(motion.x), abs(motion.y), abs(motion.yaw)
    sampled = [
        rng.normal(0.0, srr * x + str_ * yaw + 0.3 * srr * y, SAMPLES),
        rng.normal(0.0, srr * y + str_ * yaw + 0.3 * srr * x, SAMPLES),
        rng.normal(0.0, stt * yaw + srt * math.hypot(x, y), SAMPLES),
    ]
    noise = noise_of({"srr": srr, "str": str_, "srt": srt, "stt": stt})
    step = OdometryStep()
    step.add(motion)
    params = GmappingParams(odometry_noise=noise, min_translation_noise=0.0001, min_rotation_noise=0.0001)
    deviation = np.sqrt(step.variance(params))
    assert deviation == pytest.approx([samples.std() for samples in sampled], rel=0.01)


def test_srt_is_rotation_from_translation_and_str_the_reverse() -> None:
    """This is the meaning in gmapping's code; its documentation has it the other way round."""
    noise = noise_of({"srr": 0.0, "str": 0.05, "srt": 0.0, "stt": 0.0})
    straight, turn = OdometryStep(), OdometryStep()
    straight.add(SE2(1.0, 0.0, 0.0))
    turn.add(SE2(0.0, 0.0, 1.0))
    params = GmappingParams(odometry_noise=noise, min_translation_noise=0.0001, min_rotation_noise=0.0001)
    assert np.sqrt(straight.variance(params)).max() < 0.001
    assert np.sqrt(turn.variance(params)) == pytest.approx([0.05, 0.05, 0.0001], rel=0.01)


@pytest.mark.parametrize(("x", "yaw"), [(1.0, 0.0), (0.0, 0.8), (0.7, 0.6)])
def test_amcls_alphas_are_the_squares(x: float, yaw: float) -> None:
    alphas = {"alpha1": 0.02, "alpha2": 0.005, "alpha3": 0.03, "alpha4": 0.01}
    params = AmclParams(odometry_noise=noise_of(alphas, square_root=True))
    particles = np.zeros((SAMPLES, 3))
    odometry_motion.move(particles, SE2(x, 0.0, yaw), params, np.random.default_rng(3))
    turns = alphas["alpha1"] * yaw**2 + 2 * alphas["alpha2"] * x**2
    length = alphas["alpha3"] * x**2 + alphas["alpha4"] * yaw**2
    assert particles[:, 2].var() == pytest.approx(turns, rel=0.02)
    travelled = np.hypot(particles[:, 0], particles[:, 1])
    assert (travelled**2).mean() == pytest.approx(length + x**2, rel=0.02)


@pytest.mark.parametrize("key", ["srr", "str", "srt", "stt"])
def test_a_gmapping_key_is_rejected_with_the_key_to_use(key: str) -> None:
    field = OdometryNoise.ROS_KEYS[key][0]
    with pytest.raises(
        ConfigError, match=rf"unknown key '{key}' .'odometry_noise.{field}' is gmapping's {key}"
    ):
        build({key: 0.1}, GmappingParams, "launch file")
    with pytest.raises(ConfigError, match=rf"unknown key 'camera.{key}' .'camera.odometry_noise.{field}'"):
        build({"camera": {key: 0.1}}, GmappingNodeParams, "launch file")
    with pytest.raises(ConfigError, match=rf"unknown key '{key}' .'lidar.odometry_noise.{field}'"):
        build({key: 0.1}, GmappingNodeParams, "launch file")


def test_an_alpha_of_amcl_is_rejected_with_the_key_to_use() -> None:
    with pytest.raises(
        ConfigError, match=r"'odometry_noise.rotation_from_translation' is the square root of AMCL's alpha2"
    ):
        build({"alpha2": 0.2}, AmclParams, "launch file")


def test_the_four_noise_parameters_are_required_together() -> None:
    with pytest.raises(ConfigError, match=r"'odometry_noise.translation_from_rotation' is missing"):
        build({"odometry_noise": {"translation_from_translation": 0.1}}, AmclParams, "launch file")
    with pytest.raises(ConfigError, match="must be at least 0"):
        given = msgspec.structs.asdict(AmclParams().odometry_noise) | {"rotation_from_rotation": -0.1}
        build({"odometry_noise": given}, AmclParams, "launch file")
