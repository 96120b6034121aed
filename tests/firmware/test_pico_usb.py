"""The Pico at its USB connector, in rp2040js: its descriptors, and when its serial line is the USB one."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

import pytest

from chefbot.devices.serial_ports import BOARD_VENDORS
from tests.firmware.emulators import PicoAtUsb
from tests.firmware.serial_lines import add_checksum

GET_DESCRIPTOR, DEVICE, CONFIGURATION, STRING = 6, 1, 2, 3
OPEN, CLOSED = 3, 0


@pytest.fixture
def pico() -> Iterator[PicoAtUsb]:
    board = PicoAtUsb()
    yield board
    board.close()


def request(pico: PicoAtUsb, kind: int, number: int, value: int = 0, length: int = 0) -> str:
    return pico.request(f"usb_request {struct.pack('<BBHHH', kind, number, value, 0, length).hex()}")


def descriptor(pico: PicoAtUsb, kind: int, index: int = 0, length: int = 255) -> bytes:
    return bytes.fromhex(request(pico, 0x80, GET_DESCRIPTOR, kind << 8 | index, length))


def text(pico: PicoAtUsb, index: int) -> str:
    answer = descriptor(pico, STRING, index)
    assert answer[0] == len(answer) and answer[1] == STRING
    return answer[2:].decode("utf-16-le")


def test_the_device_describes_itself(pico: PicoAtUsb) -> None:
    device = descriptor(pico, DEVICE)
    assert len(device) == device[0] == 18
    vendor, _, _, maker, product, serial, configurations = struct.unpack("<3H4B", device[8:])
    assert vendor in BOARD_VENDORS and configurations == 1
    assert text(pico, maker) == "chefbot" and text(pico, product) == "chefbot motor board"
    assert text(pico, serial) == f"{zlib.crc32(pico.robot.name.encode()):08x}", "two robots have two paths"
    assert descriptor(pico, STRING)[2:] == b"\x09\x04"


def test_the_configuration_is_a_well_formed_list(pico: PicoAtUsb) -> None:
    whole = descriptor(pico, CONFIGURATION)
    assert struct.unpack_from("<H", whole, 2) == (len(whole),)
    assert descriptor(pico, CONFIGURATION, length=9) == whole[:9], "a computer reads its head first"
    parts, rest = [], whole
    while rest:
        assert 2 <= rest[0] <= len(rest)
        parts.append(rest[: rest[0]])
        rest = rest[rest[0] :]
    interfaces = [part for part in parts if part[1] == 4]
    assert [part[5] for part in interfaces] == [2, 10] and len(interfaces) == whole[4]
    endpoints = [(part[2], part[3]) for part in parts if part[1] == 5]
    assert endpoints == [(0x81, 3), (0x02, 2), (0x82, 2)]


@pytest.mark.parametrize(
    ("kind", "number", "value"),
    [(0x80, GET_DESCRIPTOR, 6 << 8), (0x80, GET_DESCRIPTOR, STRING << 8 | 9), (0xC0, 1, 0), (0x21, 0x23, 0)],
)
def test_unknown_requests_are_refused_and_harmless(
    pico: PicoAtUsb, kind: int, number: int, value: int
) -> None:
    assert request(pico, kind, number, value, 0 if kind == 0x21 else 10) == "refused"
    assert len(descriptor(pico, DEVICE)) == 18
    pico.open_session()


def test_standard_requests_are_answered(pico: PicoAtUsb) -> None:
    assert request(pico, 0x80, 0, length=2) == "0000"
    assert request(pico, 0x80, 8, length=1) == "01"
    assert request(pico, 0xA1, 0x21, length=7) == "00c20100000008"
    assert request(pico, 0x01, 11) == "ok"


def test_the_line_is_the_one_that_is_open(pico: PicoAtUsb) -> None:
    pico.run(100_000)
    assert pico.sent and pico.request("uart_sent") == "-"
    pico.request(f"usb_port {CLOSED}")
    pico.run(20_000)
    pico.request("uart_sent")
    assert not pico.run(100_000).sent, "nobody reads there"
    assert b"*" in bytes.fromhex(pico.request("uart_sent"))
    pico.request(f"usb_port {OPEN}")
    pico.run(20_000)
    pico.request("uart_sent")
    assert pico.run(100_000).sent and pico.request("uart_sent") == "-"


def test_the_uart_commands_nothing_while_usb_is_open(pico: PicoAtUsb) -> None:
    pico.request(f"uart_tx {add_checksum('v 7 1').hex()}")
    pico.run(50_000)
    assert b"v " not in pico.sent
    pico.open_session()


def test_closing_the_port_in_a_drive_stops_the_wheels(pico: PicoAtUsb) -> None:
    pico.open_session()
    for speed in (0, 2000, 2000, 2000, 2000, 2000):
        pico.set_imu_at_rest()
        pico.send_command("s", speed, speed)
        state = pico.run(10_000)
    assert min(state.duty) > 0
    pico.request(f"usb_port {CLOSED}")
    pico.run(160_000)
    assert pico.run(10_000).duty == (0, 0)


def test_a_lot_of_bytes_waits_for_room(pico: PicoAtUsb) -> None:
    """More than the board keeps: the computer has to wait, and nothing is lost."""
    noise = b"x" * 30 + b"\n"
    pico.write(noise * 40 + add_checksum("v 7 1"))
    pico.run(300_000)
    assert sum(line.startswith(b"v ") for line in pico.sent.splitlines()) == 1
