"""Motor drives at a port: recognized, driven, lost and found again, and never written to before they are sought."""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from pathlib import Path
from typing import Any

import msgspec
import pytest
from tests.devices.driven import Driven
from tests.support.motor_drives import EMULATORS

from chefbot.board.drives.drives import DRIVES
from chefbot.devices.drive_probe import LISTENING_NS, DriveProbe
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.std_msgs import String
from chefbot.robot.drivetrain import DRIVE_PROTOCOLS
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")


def robot_with(protocol: str) -> Robot:
    robot = load_robot("chefbot")
    drive = msgspec.structs.replace(robot.drive, protocol=protocol)
    return msgspec.structs.replace(robot, drive=drive)


class PluggedDrive:
    """An emulated drive at the far end of a pseudo-terminal."""

    def __init__(self, protocol: str, link: Path) -> None:
        self.drive: Any = EMULATORS[protocol]()
        self._ours, self._theirs = os.openpty()
        for end in (self._ours, self._theirs):
            tty.setraw(end)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(self._theirs))
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        before = time.monotonic()
        while not self._ended.is_set():
            ready, _, _ = select.select([self._ours], [], [], 0.005)
            now = time.monotonic()
            self.drive.turn(now - before)
            before = now
            if ready:
                os.write(self._ours, self.drive.receive(os.read(self._ours, 1000)))

    def unplug(self) -> None:
        self._ended.set()
        self._thread.join()
        os.close(self._theirs)
        os.close(self._ours)


def last_ticks(driven: Driven) -> int:
    messages = [one for one in driven.received.get("wheel_ticks", []) if isinstance(one, WheelTicks)]
    return messages[-1].left if messages else 0


@pytest.mark.parametrize("protocol", DRIVE_PROTOCOLS)
@pytest.mark.slow
def test_a_drive_is_driven_and_found_after_a_pulled_cable(protocol: str, tmp_path: Path) -> None:
    port = tmp_path / "drive"
    plugged = PluggedDrive(protocol, port)
    with Driven(str(port), robot_with(protocol)) as driven:
        driven.until(lambda: len(driven.received.get("wheel_ticks", [])) > 30, "ticks and commanded stops")
        driven.speed = 0.12
        driven.until(lambda: last_ticks(driven) > 300, "the wheels to turn")
        plugged.unplug()
        notices = driven.received["board/notice"]
        driven.until(
            lambda: any("looking" in one.data for one in notices if isinstance(one, String)), "the loss"
        )
        again, count = PluggedDrive(protocol, port), len(driven.received["wheel_ticks"])
        driven.until(lambda: len(driven.received["wheel_ticks"]) > count + 5, "ticks again")
        standing = last_ticks(driven)
        driven.until(lambda: len(driven.received["wheel_ticks"]) > count + 15, "more ticks")
        assert last_ticks(driven) == standing  # the old command does not start it
        driven.speed = 0.0
        driven.until(lambda: "looking" not in driven.health, "health")
    again.unplug()


@pytest.mark.parametrize("protocol", DRIVE_PROTOCOLS)
def test_a_port_is_only_read_at_first_unless_it_is_given(protocol: str) -> None:
    probe = DriveProbe(DRIVES[protocol], 0, alone=False)
    assert probe.data_to_send(LISTENING_NS - 1) == b""
    probe.receive_data(b"e 1 2 3", LISTENING_NS - 1)
    assert probe.timed_out(LISTENING_NS - 1) and "another device" in probe.failure_reason
    silent = DriveProbe(DRIVES[protocol], 0, alone=False)
    assert silent.data_to_send(LISTENING_NS) == DRIVES[protocol].greeting().data
    assert not silent.timed_out(LISTENING_NS) and "switched on" in silent.failure_reason
    assert DriveProbe(DRIVES[protocol], 0, alone=True).data_to_send(0) == DRIVES[protocol].greeting().data
