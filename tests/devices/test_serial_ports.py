"""Serial ports, the search for the board and the reconnecting link, with ports made of pseudo-terminals."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from chefbot.devices import port_search, serial_ports
from chefbot.devices.board_node import MotorBoardNode
from chefbot.devices.motor_board import BOARD
from chefbot.devices.port_search import PortSearch
from chefbot.devices.serial_connection import ConnectionEvents, SerialConnection, is_missing_path
from chefbot.devices.serial_ports import (
    BOARD_VENDORS,
    Port,
    explain,
    explain_disconnection,
    find_same_device,
    open_port,
    port_at,
    ports,
    receive,
)
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.sensor_msgs import BatteryState, Imu, Range
from chefbot.msgs.std_msgs import String
from chefbot.robot.sensors import AUTO

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")
ARDUINO = Port("/dev/ttyACM0", "Arduino", 0x2341, 0x42, "abc")


def listed(*found: Port) -> list[Any]:
    return [
        SimpleNamespace(
            device=p.path, description=p.description, vid=p.vendor, pid=p.product, serial_number=p.serial
        )
        for p in found
    ]


@pytest.fixture
def pty() -> Iterator[tuple[int, str]]:
    ours, theirs = os.openpty()
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_likely_boards_come_first_and_empty_ports_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    other = Port("/dev/a", "modem", 0x1234, 1, None)
    empty = Port("/dev/ttyS0", "n/a", None, None, None)
    monkeypatch.setattr(serial_ports.list_ports, "comports", lambda: listed(other, empty, ARDUINO))
    assert ports() == [ARDUINO, other]
    assert ARDUINO.vendor in BOARD_VENDORS


def test_a_renumbered_device_is_found_by_its_usb_identity(monkeypatch: pytest.MonkeyPatch) -> None:
    moved = ARDUINO._replace(path="/dev/ttyACM7")
    swapped = Port("/dev/ttyACM0", "other", 0x2341, 0x42, "xyz")
    monkeypatch.setattr(serial_ports.list_ports, "comports", lambda: listed(swapped, moved))
    assert find_same_device(ARDUINO) == moved
    plain = Port("/dev/pts/3", "", None, None, None)
    assert find_same_device(plain) == plain and plain.identity is None


def test_of_equal_adapters_the_one_at_the_path_is_meant(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    here, there, link = (tmp_path / name for name in ("ttyUSB1", "ttyUSB0", "board"))
    here.touch(), there.touch(), link.symlink_to(here)
    equal = [ARDUINO._replace(path=str(path.resolve())) for path in (there, here)]
    monkeypatch.setattr(serial_ports.list_ports, "comports", lambda: listed(*equal))
    assert find_same_device(port_at(str(link))) == ARDUINO._replace(path=str(link))
    assert find_same_device(equal[1]) == equal[1]
    elsewhere = ARDUINO._replace(path=str(tmp_path / "ttyUSB7"))
    assert find_same_device(elsewhere) == elsewhere, "either may be it"


def test_a_link_to_a_port_keeps_its_own_path(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    target, link = tmp_path / "ttyACM0", tmp_path / "board"
    target.touch()
    link.symlink_to(target)
    device = ARDUINO._replace(path=str(target.resolve()))
    monkeypatch.setattr(serial_ports.list_ports, "comports", lambda: listed(device))
    assert port_at(str(link)) == device._replace(path=str(link))
    assert is_missing_path(str(tmp_path / "none")) and not is_missing_path(AUTO)


@pytest.mark.parametrize(
    ("code", "part"),
    [
        (errno.EACCES, "chefbot doctor"),
        (errno.EAGAIN, "in use"),
        (errno.ENOENT, "is not there"),
        (errno.EISDIR, "not a serial port"),
        (errno.EIO, "cannot be opened"),
    ],
)
def test_each_error_of_a_port_has_its_remedy(code: int, part: str) -> None:
    text = explain("/dev/x", OSError(code, os.strerror(code)))
    assert text.startswith("/dev/x") and part in text


def test_a_lost_port_is_explained() -> None:
    assert "cable is unplugged" in explain_disconnection("/dev/x", OSError(errno.EIO, "Input/output error"))
    assert "odd" in explain_disconnection("/dev/x", OSError("odd"))


def test_a_port_is_exclusive_and_old_bytes_are_discarded(pty: tuple[int, str]) -> None:
    ours, path = pty
    os.write(ours, b"old")
    with open_port(path) as port:
        os.write(ours, b"new line")
        found = b""
        while len(found) < len(b"new line"):
            found += receive(port)
        assert found == b"new line"
        with pytest.raises(OSError) as caught:
            open_port(path)
        assert "in use" in explain(path, caught.value)


@pytest.mark.slow
def test_a_search_ends_with_the_reason_of_each_port(
    pty: tuple[int, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    clock = [10_000_000_000]
    monkeypatch.setattr(port_search, "wall_ns", lambda: clock[0])
    missing = str(tmp_path / "none")
    search = PortSearch(BOARD, lambda: [Port(path, "", None, None, None) for path in (pty[1], missing)])
    try:
        assert search.step() is None and not search.exhausted
        for _ in range(100):
            clock[0] += 1_000_000_000
            if search.exhausted:
                break
            assert search.step() is None
        assert search.exhausted
        assert pty[1] in search.reasons and missing in search.reasons
    finally:
        search.close()
    assert PortSearch(BOARD, list).reasons == "no serial port has anything plugged in"


def test_a_connection_without_a_board_reports_it(tmp_path: Path) -> None:
    missing, reasons = threading.Event(), list[str]()

    def report(reason: str) -> None:
        reasons.append(reason)
        missing.set()

    def unexpected(*_: Any) -> None:
        raise AssertionError

    events = ConnectionEvents(unexpected, unexpected, unexpected, report)
    link = SerialConnection(str(tmp_path / "none"), BOARD, events)
    assert not link.send(b"x")
    link.start()
    assert missing.wait(60.0)
    link.close()
    assert "is not there" in reasons[0]


def test_a_write_that_fails_is_not_a_success() -> None:
    def failing(_: bytes) -> int:
        raise OSError("gone")

    link = SerialConnection(AUTO, BOARD, ConnectionEvents(*[lambda *_: None] * 4))
    for write, success in ((len, True), (lambda data: len(data) - 1, False), (failing, False)):
        port: Any = SimpleNamespace(write=write)
        link._serial = port
        assert link.send(b"data") is success
        assert link.send(b""), "nothing to send"


def test_each_sensor_message_has_its_topic() -> None:
    topics = ("wheel_ticks", "imu", "ultrasonic", "battery_state")
    published: dict[str, list[Any]] = {name: [] for name in topics}
    board: Any = SimpleNamespace(
        **{name: SimpleNamespace(publish=sent.append) for name, sent in published.items()}
    )
    messages = (WheelTicks(), Imu(), Range(), BatteryState())
    for message in messages:
        MotorBoardNode.publish_sensor_message(board, message)
    assert [published[name] for name in topics] == [[message] for message in messages]
    with pytest.raises(TypeError, match="String"):
        MotorBoardNode.publish_sensor_message(board, String())
