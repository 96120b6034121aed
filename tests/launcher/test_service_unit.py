"""The systemd unit of a built robot: it starts the given launch, has a watchdog, and does not repeat bad input."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chefbot.errors import UserError
from chefbot.launcher.service_unit import _quoted, service_unit

KEYS_SINCE_254 = ("'RestartSteps'", "'RestartMaxDelaySec'")
"""Keys of the growing delay, which systemd 253 and older ignore."""


def test_the_unit_starts_the_launch_with_absolute_paths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.yaml").write_text("like: chefbot_lidar\nname: mine\n")
    unit = service_unit(
        "robot_standalone", ["robot:=./my.yaml", "headless:=true"], "cook", Path("bot.service")
    )
    command = f"{sys.executable} -m chefbot launch robot_standalone robot:={tmp_path}/my.yaml headless:=true"
    assert f"ExecStart={command}\n" in unit and "User=cook\n" in unit
    for line in ("Type=notify", "WatchdogSec=2", "Restart=on-failure", "RestartPreventExitStatus=2"):
        assert f"{line}\n" in unit


@pytest.mark.parametrize(
    ("launch", "arguments", "expected"),
    [
        ("explore", [], "simulates a robot"),
        ("robot_standalon", [], "no launch is called"),
        ("robot_standalone", ["boardport:=x"], "there is no argument 'boardport'"),
        ("robot_standalone", ["board_port"], "write key:=value"),
    ],
)
def test_what_cannot_be_started_is_refused(launch: str, arguments: list[str], expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        service_unit(launch, arguments, "cook", Path("bot.service"))


@pytest.mark.parametrize(
    ("word", "quoted"),
    [("plain:=1", "plain:=1"), ("a b", '"a b"'), ('"', '"\\""'), ("50%", '"50%%"'), ("$HOME", '"$$HOME"')],
)
def test_arguments_of_the_command_are_quoted(word: str, quoted: str) -> None:
    assert _quoted(word) == quoted


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_accepts_the_unit(tmp_path: Path) -> None:
    file = tmp_path / "bot.service"
    file.write_text(service_unit("robot_standalone", ["board_port:=/dev/a b"], "root", file))
    done = subprocess.run(
        ["systemd-analyze", "verify", str(file)], capture_output=True, text=True, check=False
    )
    complaints = [line for line in done.stderr.splitlines() if "bot.service" in line]
    assert all(any(key in line for key in KEYS_SINCE_254) for line in complaints), complaints
