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


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", "robot", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


def test_the_file_passes_the_check_and_repeats(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    out = tmp_path / "new" / "robot3.yaml"
    words = ("generate", "--seed", "3", "--set", "radius=0.2", "--out", str(out))
    assert run(monkeypatch, *words) == 0
    first = out.read_bytes()
    assert first.decode().splitlines()[0] == "# chefbot robot generate --seed 3 --set radius=0.2"
    assert load_robot(str(out)).body.radius == 0.2
    assert run(monkeypatch, "check", str(out)) == 0
    assert run(monkeypatch, *words) == 0
    assert out.read_bytes() == first


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--set radus=0.2", "did you mean 'radius'"),
        ("--set radius=2", "from 0.16 to 0.25 m"),
        ("--set radius", "as --set radius=0.2"),
        ("--set radius=inf", "a finite number"),
        ("--out robot.json", "ends in .yaml"),
    ],
)
def test_bad_input_is_one_sentence(
    words: str,
    message: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "generate", *words.split()) == 2
    error = capsys.readouterr().err
    assert message in " ".join(error.split())
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


def test_the_summary_has_the_figures_of_the_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "robot.yml"
    run_generate(5, ["eyes=2", "payload=1.5"], out)
    robot = load_robot(str(out))
    printed = capsys.readouterr().out
    assert printed.startswith(f"robot_5: radius {robot.circumscribed_radius:.3f} m, ")
    assert f"{unloaded_mass(robot):.2f} kg and 1.50 kg of payload" in printed
    assert "lidar of " in printed and "depth camera of " in printed and printed.endswith(f"robot in {out}\n")


@pytest.mark.parametrize("name", ["robot", "robot.json", "yaml"])
def test_a_robot_file_is_yaml(name: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"a robot file is YAML; give a name that ends in \.yaml"):
        run_generate(1, [], tmp_path / name)
    assert not list(tmp_path.iterdir())
