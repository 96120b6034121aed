"""`chefbot doctor --built`: each device of a robot on its real bytes, and a sentence for those that are not there."""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest
from tests.devices.emulated import Emulator
from tests.devices.emulated_lidar import PluggedLidar
from tests.support.waiting import PATIENCE

from chefbot.board.link_health import TICKS_STALE
from chefbot.cli.doctor.built import built_lines, devices_of
from chefbot.cli.doctor.computer import power_lines
from chefbot.cli.doctor.report import print_report
from chefbot.errors import UserError
from chefbot.robot.load import load_robot

ROBOT = """\
like: chefbot_lidar
name: mine
sensors:
  lidar: {{driver: ld19, port: {port}}}
"""


@pytest.fixture
def robot_file(tmp_path: Path) -> str:
    path = tmp_path / "mine.yaml"
    path.write_text(ROBOT.format(port=tmp_path / "lidar"))
    return str(path)


def lines_in_time(robot_file: str, ports: dict[str, str]) -> list[str]:
    """Return the lines of a look at which no busy computer made the emulated board late."""
    give_up = time.monotonic() + PATIENCE
    while True:
        lines = built_lines(robot_file, ports, PATIENCE)
        if time.monotonic() > give_up or not any(TICKS_STALE[1:] in line for line in lines):
            return lines


@pytest.mark.slow
def test_board_and_lidar_are_found_with_their_streams(robot_file: str, tmp_path: Path) -> None:
    emulated, plugged = Emulator(tmp_path, robot_file), PluggedLidar("ld19", tmp_path / "lidar")
    try:
        lines = lines_in_time(robot_file, {"board": str(emulated.path)})
    finally:
        emulated.close()
        plugged.unplug()
    text = "\n".join(lines)
    assert f"  board at {emulated.path}: " in text and f"  lidar at {tmp_path / 'lidar'}: " in text
    for stream in ("wheel ticks", "IMU", "ultrasonic", "scans"):
        (rate,) = re.findall(rf"{stream}: ([0-9.]+) Hz", text)
        assert float(rate) > 0.0
    assert "battery: " in text
    assert not [line for line in lines if line.startswith("! ") and "Hz" not in line]


def test_missing_ports_are_problems(robot_file: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert print_report(everything=False, built=robot_file, ports={"board": "/dev/no_board"}) >= 2
    text = capsys.readouterr().out
    assert "! board: its port /dev/no_board does not exist" in text and "! lidar: its port " in text
    assert "expected on /camera/depth/image_raw" in text and "wheels are not driven" in text


def test_one_port_for_two_devices_is_refused(robot_file: str) -> None:
    with pytest.raises(UserError, match="board and lidar have the same port, /dev/ttyUSB0"):
        built_lines(robot_file, {"board": "/dev/ttyUSB0", "lidar": "/dev/ttyUSB0"}, 1.0)


@pytest.mark.slow
def test_a_port_without_a_board_is_a_problem(robot_file: str, tmp_path: Path) -> None:
    plugged = PluggedLidar("ld19", tmp_path / "lidar")  # a lidar where the board was expected
    try:
        lines = built_lines(robot_file, {"board": str(tmp_path / "lidar"), "lidar": "/dev/no_lidar"}, 4.0)
    finally:
        plugged.unplug()
    (problem,) = [line for line in lines if line.startswith("! board: ")]
    assert "no motor board" in problem or "not been found" in problem


def test_every_driver_of_the_robot_file_is_run(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "like: chefbot_lidar\nname: all\ndrive: {protocol: roboclaw}\nsensors:\n  imu: {driver: witmotion}\n"
        "  lidar: {driver: ld19}\n  depth_camera: {driver: realsense}\n"
    )
    devices = devices_of(load_robot(str(path)))
    assert [device.title for device in devices] == ["board", "imu", "lidar", "depth_camera"]
    assert [stream.title for stream in devices[0].streams] == ["wheel ticks"]


@pytest.mark.parametrize(("alarm", "count"), [("1", 1), ("0", 0)])
def test_a_raspberry_pi_reports_its_supply(tmp_path: Path, alarm: str, count: int) -> None:
    for number, name in enumerate(("cpu_thermal", "rpi_volt")):
        folder = tmp_path / f"hwmon{number}"
        folder.mkdir()
        (folder / "name").write_text(f"{name}\n")
    (tmp_path / "hwmon1" / "in0_lcrit_alarm").write_text(f"{alarm}\n")
    assert len(power_lines(tmp_path)) == count
