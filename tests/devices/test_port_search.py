"""The search for board and lidar at several ports: which is whose, and that nobody is disturbed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.devices.emulated_lidar import PluggedLidar
from tests.devices.session import ROBOT
from tests.support.waiting import PATIENCE

from chefbot.devices import serial_ports
from chefbot.devices.motor_board import BOARD
from chefbot.devices.port_search import PortSearch, SerialDevice
from chefbot.devices.serial_lidar import lidar_device
from chefbot.devices.serial_ports import ports
from chefbot.lidar.models import LIDARS
from chefbot.sim.firmware import CONTROL_NS, Firmware
from chefbot.sim.ports.pseudo_terminal import PseudoTerminal


class PluggedBoard:
    """The firmware at a port, with what it is sent."""

    def __init__(self, link: Path) -> None:
        self._port, self._firmware = PseudoTerminal(link), Firmware(ROBOT)
        self.received = b""
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.wait(CONTROL_NS / 1e9):
            self._port.take_opening()
            data = self._port.read()
            self.received += data
            self._firmware.write(data)
            self._firmware.step((0, 0), 12_000)
            self._port.write(self._firmware.read())

    def unplug(self) -> None:
        self._ended.set()
        self._thread.join()
        self._port.close()


@pytest.fixture
def plugged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], Any]]:
    """Plugs a device in at a port with a name; all are on equal adapters."""
    paths: list[str] = []
    listed = lambda: [  # noqa: E731
        SimpleNamespace(device=path, description="USB serial", vid=0x10C4, pid=0xEA60, serial_number="0001")
        for path in paths
    ]
    monkeypatch.setattr(serial_ports.list_ports, "comports", listed)
    with ExitStack() as stack:

        def plug(kind: str, name: str) -> Any:
            path = tmp_path / name
            device = PluggedBoard(path) if kind == "board" else PluggedLidar(kind, path)
            stack.callback(device.unplug)
            paths.append(str(path))
            return device

        yield plug


def found(device: SerialDevice[Any]) -> str:
    """The path where a device is found, or the reasons why it is not."""
    search, limit = PortSearch(device, ports), time.monotonic() + PATIENCE
    try:
        while time.monotonic() < limit:
            result = search.step()
            if result is not None:
                result.opened.close()
                return result.path
            if search.exhausted:
                return search.reasons
        raise AssertionError("the search does not end")
    finally:
        search.close()


@pytest.mark.parametrize("driver", ["ld19", "rplidar_c1"])
@pytest.mark.slow
def test_each_device_is_found_beside_the_other(plugged: Callable[[str, str], Any], driver: str) -> None:
    board, lidar = plugged("board", "a"), plugged(driver, "b")
    assert found(lidar_device(LIDARS[driver])).endswith("b")
    assert board.received == b"", "the search for the lidar has written to the board"
    before = lidar.received
    assert found(BOARD).endswith("a")
    assert lidar.received == before, "the search for the board has written to the lidar"


def test_of_two_lidars_the_owner_must_name_one(plugged: Callable[[str, str], Any]) -> None:
    plugged("ld19", "a"), plugged("ld19", "b")
    reasons = found(lidar_device(LIDARS["ld19"]))
    assert "name the port" in reasons and reasons.count("there is a lidar") == 1


def test_of_two_boards_the_owner_must_name_one(plugged: Callable[[str, str], Any]) -> None:
    plugged("board", "a"), plugged("board", "b")
    reasons = found(BOARD)
    assert "name the port" in reasons and reasons.count("there is a motor board") == 1


@pytest.mark.slow
def test_a_lidar_in_place_of_the_board_is_recognized(plugged: Callable[[str, str], Any]) -> None:
    lidar = plugged("ld19", "a")
    assert "not from a motor board: is it the lidar" in found(BOARD)
    assert lidar.received == b""


@pytest.mark.slow
def test_a_lidar_of_another_baud_rate_is_another_model(plugged: Callable[[str, str], Any]) -> None:
    """A pseudo-terminal passes bytes at any rate, so another protocol stands for another rate."""
    plugged("ydlidar_x2", "a")
    assert "another model" in found(lidar_device(LIDARS["ld19"]))
