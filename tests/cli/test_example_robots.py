"""The robots that come as examples drive: their boards, made for their motors, let them."""

import struct
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader

from chefbot.robot.load import load_robot


@pytest.mark.rotated("drives of whole robots")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["desk", "porter"])
def test_example_robot_explores_and_its_board_reports_no_fault(name: str, tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    launch = [
        *("launch", "explore", "world:=room", f"robot:={name}", "headless:=true", "speed:=0"),
        *("duration:=20", f"record:={log}"),
    ]
    subprocess.run([sys.executable, "-m", "chefbot", *launch], check=True, capture_output=True)
    with log.open("rb") as file:
        messages = [
            (channel.topic, message.data) for _, channel, message in make_reader(file).iter_messages()
        ]
    assert not [data for topic, data in messages if topic == "/diagnostics" and b"motors are off" in data]
    left, right = struct.unpack(
        "<qq", [data for topic, data in messages if topic == "/wheel_ticks"][-1][-16:]
    )
    assert (left + right) / 2 * load_robot(name).metres_per_tick > 0.5
