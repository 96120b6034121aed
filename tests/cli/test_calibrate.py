"""`chefbot robot calibrate` on simulated robots: what it writes, and its errors."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from chefbot.cli.robot import calibrate
from chefbot.cli.robot.calibrate import CalibrateOptions, run_calibrate
from chefbot.config import ConfigError
from chefbot.errors import UserError
from chefbot.nodes.calibrator import CalibratorNode
from chefbot.robot.as_built import AsBuilt
from chefbot.robot.load import load_robot
from chefbot.sim import simulation
from chefbot.sim.realism import draw_as_built


def options(out: Path, *arguments: str, robot: str = "chefbot_lidar", seed: int = 2) -> CalibrateOptions:
    return CalibrateOptions(robot, list(arguments), True, seed, out, "calibrate")


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
def test_uncalibrated_robot_gets_a_correct_calibration_file(tmp_path: Path) -> None:
    run_calibrate(options(tmp_path, "squares:=1", "side:=1.5"))
    summary = json.loads((tmp_path / "calibration.json").read_text())
    found, truth = summary["found"], summary["truth_of_the_simulator"]
    for key, bound in (
        ("left_wheel", 1e-3),
        ("right_wheel", 1e-3),
        ("separation", 2e-3),
        ("gyro_scale", 2e-3),
    ):
        assert found[key]["value"] == pytest.approx(truth[key], rel=bound)
        assert abs(found[key]["value"] - truth[key]) < 4.0 * found[key]["deviation"] + 1e-4
    assert found["lidar_yaw"]["value"] == pytest.approx(truth["lidar_yaw"], abs=3e-3)
    worst = summary["worst_return_m"]
    assert worst["after"] < 0.1 * worst["before"]
    assert worst["check_squares_with_old_numbers"] > 0.5 * worst["before"]
    robot, drawn = load_robot(str(tmp_path / "robot.yaml")), load_robot("chefbot_lidar")
    assert robot.left_wheel_radius == pytest.approx(drawn.wheel_radius * truth["left_wheel"], rel=1e-3)
    assert robot.wheels == drawn.wheels
    assert (tmp_path / "calibration.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(UserError, match="refer to itself"):
        run_calibrate(options(tmp_path, robot=str(tmp_path / "robot.yaml")))


@pytest.mark.rotated("places without room for a calibration")
@pytest.mark.slow
def test_robot_without_a_visible_wall_stops_and_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"sees walls with 0 % of its beams.*no robot file was written"):
        run_calibrate(options(tmp_path, "world:=empty"))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap"]


@pytest.mark.rotated("places without room for a calibration")
@pytest.mark.slow
def test_too_little_space_is_reported_with_the_space_needed(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no room for a square of 9.0 m; put the robot"):
        run_calibrate(options(tmp_path, "side:=9"))


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_swapped_encoder_is_recognized(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, side: str) -> None:
    def swapped(profile: Any, rng: np.random.Generator, error: float) -> AsBuilt:
        return draw_as_built(profile, rng, error)._replace(**{f"{side}_encoder": -1})

    monkeypatch.setattr(simulation, "draw_as_built", swapped)
    with pytest.raises(
        UserError, match=f"the {side} encoder counts against its motor: swap its wires A and B"
    ):
        run_calibrate(options(tmp_path))


def test_an_interrupted_run_leaves_the_old_file_unchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "robot.yaml").write_text("like: chefbot\n")

    monkeypatch.setattr(calibrate, "stop_on_signals", lambda stop: _Stopping(stop))
    with pytest.raises(UserError, match="interrupted"):
        run_calibrate(options(tmp_path))
    assert yaml.safe_load((tmp_path / "robot.yaml").read_text()) == {"like": "chefbot"}


class _Stopping:
    """Ctrl-C while it drives."""

    def __init__(self, stop: Callable[[], None]) -> None:
        self._stop = stop

    def __enter__(self) -> None:
        original, stop = CalibratorNode._straight, self._stop

        async def press(node: CalibratorNode, metres: float) -> None:
            stop()
            await original(node, metres)

        self._original, CalibratorNode._straight = original, press  # type: ignore[method-assign]

    def __exit__(self, *_: object) -> None:
        CalibratorNode._straight = self._original  # type: ignore[method-assign]


def test_bad_arguments_are_reported_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="has no node calibrator"):
        run_calibrate(CalibrateOptions("chefbot", [], False, 1, tmp_path, "model_robot"))
    with pytest.raises(UserError, match="key:=value"):
        run_calibrate(options(tmp_path, "squares=2"))
    with pytest.raises(ConfigError, match="squares"):
        run_calibrate(options(tmp_path, "squares:=0"))
