"""`chefbot robot generate`: a robot file that every command takes, and bad input in one sentence."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from chefbot.cli.app import main
from chefbot.cli.robot.generate import run_generate
from chefbot.errors import UserError
from chefbot.robot.geometry.mass import unloaded_mass
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", "robot", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


def assert_summary(printed: str, robot: Robot, out: Path) -> None:
    """The figures of a robot are printed."""
    assert printed.startswith(f"{robot.name}: radius {robot.circumscribed_radius:.3f} m, ")
    assert f"{unloaded_mass(robot):.2f} kg and {robot.body.payload:.2f} kg of payload" in printed
    assert ("lidar of " in printed) == (robot.sensors.lidar is not None)
    assert ("depth camera of " in printed) == (robot.sensors.depth_camera is not None)
    assert printed.endswith(f"robot in {out}\n")


@pytest.mark.slow
def test_the_file_passes_the_check_and_repeats(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "robot3.yaml"
    arguments = ("generate", "--seed", "3", "--set", "radius=0.2", "--out", str(out))
    assert run(monkeypatch, *arguments) == 0
    assert_summary(capsys.readouterr().out, load_robot(str(out)), out)
    first = out.read_bytes()
    assert first.decode().splitlines()[0] == "# chefbot robot generate --seed 3 --set radius=0.2"
    assert load_robot(str(out)).body.radius == 0.2
    assert run(monkeypatch, "check", str(out)) == 0
    assert run(monkeypatch, *arguments) == 0
    assert out.read_bytes() == first


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--set radus=0.2", "did you mean 'radius'"),
        ("--set radius=2", "from 0.16 to 0.25 m"),
        ("--set radius", "as --set radius=0.2"),
        ("--set radius=inf", "a finite number"),
        ("--out robot.json", "ends in .yaml"),
    ],
)
def test_bad_input_is_reported_in_one_sentence(
    arguments: str,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "generate", *arguments.split()) == 2
    error = capsys.readouterr().err
    assert message in " ".join(error.split())
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["robot", "robot.json", "yaml"])
def test_a_robot_file_is_yaml(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"a robot file is YAML; give a name that ends in \.yaml"):
        run_generate(1, [], tmp_path / name)
    assert not list(tmp_path.iterdir())
