"""Programs of the motor board with a robot filled in: block, file formats, and the programs of the package."""

from __future__ import annotations

import json
import re
import runpy
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.support.wirings import WIRINGS, wired

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.board.firmware_image import (
    FAMILY_RP2040,
    PICO_FLASH,
    FirmwareImageError,
    intel_hex,
    mark_of,
    uf2,
    with_robot,
)
from chefbot.cli.board.image import FORMATS, IMAGES
from chefbot.robot.board import PicoPins
from chefbot.robot.drivetrain import DRIVER_INPUTS
from chefbot.robot.load import built_in_robots, load_robot

FIRMWARE = Path(__file__).parents[2] / "firmware"
ROBOT = load_robot("chefbot")
OWN_BOARD = [name for name in sorted(built_in_robots()) if not load_robot(name).drive.protocol]


@pytest.fixture(scope="module")
def builder() -> dict[str, Any]:
    return runpy.run_path(str(FIRMWARE / "images.py"))


@pytest.mark.parametrize("board", FORMATS)
@pytest.mark.parametrize("name", OWN_BOARD)
def test_only_the_block_differs_between_robots(board: str, name: str) -> None:
    program, robot = (IMAGES / f"{board}.bin").read_bytes(), load_robot(name)
    filled, mark = with_robot(program, robot, board), mark_of(board)
    start = program.index(mark)
    count = len(firmware_constants(robot))
    end = start + len(mark) + 4 * count + 16
    assert filled[:start] == program[:start] and filled[end + 4 :] == program[end + 4 :]
    assert filled[end : end + 4] == zlib.crc32(name.encode()).to_bytes(4, "little")
    assert filled[start:].startswith(mark)
    constants = struct.unpack_from(f"<{count}i", filled, start + len(mark))
    assert constants == tuple(as_int32(constant.value) for constant in firmware_constants(robot))
    assert tuple(filled[end - 16 : end]) == (
        *robot.board.pins.by_name().values(),
        DRIVER_INPUTS.index(robot.driver.inputs),
    )


@pytest.mark.parametrize("name", WIRINGS)
def test_each_wiring_is_another_image(name: str, tmp_path: Path) -> None:
    program = (IMAGES / "pico.bin").read_bytes()
    assert with_robot(program, load_robot(wired(name, tmp_path)), "pico") != with_robot(
        program, ROBOT, "pico"
    )


def test_the_programs_of_the_package_contain_no_robot() -> None:
    for board in FORMATS:
        program = (IMAGES / f"{board}.bin").read_bytes()
        start = program.index(mark_of(board)) + len(mark_of(board))
        assert not any(program[start : start + 4 * len(firmware_constants(ROBOT)) + 20])


def test_fields_are_in_the_order_of_the_firmware() -> None:
    text = (FIRMWARE / "ports" / "robot_block.h").read_text()
    pins = re.search(r"struct PicoPins \{\s*uint8_t ([^;]*);", text)
    assert pins and re.split(r",\s*", pins[1]) == list(PicoPins().by_name())
    inputs = re.search(r"enum DriverInputs.*\{(.*)\}", (FIRMWARE / "ports" / "driver_inputs.h").read_text())
    assert inputs and tuple(inputs[1].lower().replace(" ", "").split(",")) == DRIVER_INPUTS


MEGA = mark_of("mega")


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        (b"", "no place for a robot"),
        (bytes(4000), "no place for a robot"),
        (MEGA + bytes(100) + MEGA + bytes(100), "no place for a robot"),
        (bytes(100) + MEGA + bytes(75), "is cut off"),
        ((IMAGES / "tiva.bin").read_bytes(), "is not chefbot's firmware for the mega"),
        (uf2((IMAGES / "mega.bin").read_bytes()), "packed as UF2"),
    ],
)
def test_what_is_not_the_firmware_is_refused(program: bytes, reason: str) -> None:
    with pytest.raises(FirmwareImageError, match=reason):
        with_robot(program, ROBOT, "mega")


def test_the_programs_are_those_of_the_sources(builder: dict[str, Any]) -> None:
    made_of = json.loads((IMAGES / "images.json").read_text())
    assert made_of["sources"] == builder["sources_digest"](), "run `make -C firmware images`"


@pytest.mark.slow
def test_the_same_compilers_give_the_same_programs(builder: dict[str, Any], tmp_path: Path) -> None:
    for tool in ("make", *builder["COMPILERS"]):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    versions = builder["compiler_versions"]()
    if versions != json.loads((IMAGES / "images.json").read_text())["compilers"]:
        pytest.skip(f"the programs are of other compilers than {versions}")
    targets = [f"{tmp_path}/{board}.bin" for board in FORMATS]
    command = ["make", "-s", "-C", str(FIRMWARE), f"BUILD={tmp_path}", f"PYTHON={sys.executable}", *targets]
    subprocess.run(command, check=True, capture_output=True)
    for board in FORMATS:
        assert (tmp_path / f"{board}.bin").read_bytes() == (IMAGES / f"{board}.bin").read_bytes()


@given(st.binary(min_size=1, max_size=600))
def test_intel_hex_contains_the_program(program: bytes) -> None:
    data, ended = b"", False
    for line in intel_hex(program).decode().splitlines():
        record = bytes.fromhex(line.removeprefix(":"))
        assert line.startswith(":") and sum(record) % 256 == 0 and not ended
        assert record[0] == len(record) - 5
        assert record[3] == 1 or int.from_bytes(record[1:3], "big") == len(data)
        data += record[4:-1]
        ended = record[3] == 1
    assert data == program and ended


def test_intel_hex_goes_on_behind_64_kilobytes() -> None:
    lines = intel_hex(bytes(65536 + 16)).decode().splitlines()
    assert lines[4096:] == [":020000040001F9", ":10000000" + "00" * 16 + "F0", ":00000001FF"]


@given(st.binary(min_size=1, max_size=2000))
def test_uf2_contains_the_program(program: bytes) -> None:
    packed = uf2(program)
    assert len(packed) % 512 == 0
    data = b""
    for i in range(len(packed) // 512):
        block = packed[512 * i : 512 * (i + 1)]
        magic, second, flags, address, size, number, count, family = struct.unpack_from("<8I", block)
        assert (magic, second, flags, family) == (0x0A324655, 0x9E5D5157, 0x2000, FAMILY_RP2040)
        assert (address, number, count) == (PICO_FLASH + len(data), i, len(packed) // 512)
        assert struct.unpack_from("<I", block, 508) == (0x0AB16F30,)
        data += block[32 : 32 + size]
    assert data[: len(program)] == program and not any(data[len(program) :])
