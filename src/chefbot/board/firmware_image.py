"""A compiled program of the motor board with a robot filled in, and the file formats of the flashing tools.

A program is compiled without a robot; it has a block for one, which is found by its mark
(firmware/ports/robot_block.h).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.errors import ChefbotError
from chefbot.robot.drivetrain import DRIVER_INPUTS
from chefbot.robot.spec import Robot

MARK_SIZE = 16
UF2_MAGIC = b"UF2\n"
PICO_FLASH = 0x10000000
"""Address of the RP2040's flash memory (RP2040 data sheet, 2.2)."""
FAMILY_RP2040 = 0xE48BFF56
UF2_PAYLOAD = 256


class FirmwareImageError(ChefbotError):
    """A compiled program that has no place for a robot."""


def mark_of(board: str) -> bytes:
    """Return the start of the block in the program of a kind of board; it ends with the version of the layout."""
    return f"chefbot-{board}-2".encode().ljust(MARK_SIZE, b"\0")


def with_robot(program: bytes, robot: Robot, board: str) -> bytes:
    """Return the program of a kind of board for a robot: its constants, pins and driver inputs are in the block.

    Raises FirmwareImageError for a program without such a block, or with two.
    """
    mark = mark_of(board)
    if program.startswith(UF2_MAGIC):
        raise FirmwareImageError("it is packed as UF2; give the raw program, .bin")
    if program.count(mark) != 1:
        raise FirmwareImageError(
            f"it is not chefbot's firmware for the {board}, or of another version: there is no place for a robot"
        )
    block, start = mark + _content(robot), program.index(mark)
    if start + len(block) > len(program):
        raise FirmwareImageError("it is cut off within the place for the robot; compile or download it again")
    return program[:start] + block + program[start + len(block) :]


def _content(robot: Robot) -> bytes:
    """Return the bytes of `RobotBlock` behind the mark."""
    constants = [as_int32(constant.value) for constant in firmware_constants(robot)]
    pins = robot.board.pins.by_name().values()
    inputs = DRIVER_INPUTS.index(robot.driver.inputs)
    name_crc = zlib.crc32(robot.name.encode()).to_bytes(4, "little")
    return struct.pack(f"<{len(constants)}i", *constants) + bytes([*pins, inputs]) + name_crc


def intel_hex(program: bytes) -> bytes:
    """Return a program that starts at address 0 in Intel HEX (Intel, Hexadecimal Object File Format, 1988)."""
    return "".join(f"{line}\n" for line in _hex_lines(program)).encode()


def _hex_lines(program: bytes) -> Iterator[str]:
    for address in range(0, len(program), 16):
        if address % 65536 == 0 and address > 0:
            yield _hex_record(0, 4, (address >> 16).to_bytes(2, "big"))
        yield _hex_record(address % 65536, 0, program[address : address + 16])
    yield _hex_record(0, 1, b"")


def _hex_record(address: int, kind: int, data: bytes) -> str:
    record = bytes([len(data), address >> 8, address & 255, kind]) + data
    return f":{record.hex()}{-sum(record) & 255:02x}".upper()


def uf2(program: bytes) -> bytes:
    """Return a program for the RP2040 in UF2 (github.com/microsoft/uf2)."""
    blocks = [
        program[i : i + UF2_PAYLOAD].ljust(UF2_PAYLOAD, b"\0") for i in range(0, len(program), UF2_PAYLOAD)
    ]
    return b"".join(_uf2_block(block, i, len(blocks)) for i, block in enumerate(blocks))


def _uf2_block(payload: bytes, number: int, count: int) -> bytes:
    header = struct.pack(
        "<8I",
        0x0A324655,
        0x9E5D5157,
        0x2000,
        PICO_FLASH + number * UF2_PAYLOAD,
        UF2_PAYLOAD,
        number,
        count,
        FAMILY_RP2040,
    )
    return header + payload.ljust(476, b"\0") + struct.pack("<I", 0x0AB16F30)
