"""Design errors of a robot file are printed before it is simulated or driven."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from chefbot.launcher.design_errors import print_design_errors
from chefbot.robot.load import load_robot


def printed(name_or_path: str) -> str:
    out = io.StringIO()
    print_design_errors(Console(file=out, width=200), name_or_path, load_robot(name_or_path))
    return out.getvalue()


def test_each_error_of_a_robot_file_is_a_line(tmp_path: Path) -> None:
    path = tmp_path / "wide.yaml"
    path.write_text("like: chefbot_lidar\nname: wide\nbody: {radius: 35 cm}\n")
    *lines, advice = printed(str(path)).splitlines()
    assert len(lines) > 1 and all(line.startswith("Error of robot wide: ") for line in lines)
    assert any("camera" in line for line in lines)
    assert advice == f"`chefbot robot check {path}` shows the figures."


def test_a_sound_robot_file_prints_nothing(tmp_path: Path) -> None:
    path = tmp_path / "same.yaml"
    path.write_text("like: chefbot\nname: same\n")
    assert printed(str(path)) == "" == printed("chefbot")
