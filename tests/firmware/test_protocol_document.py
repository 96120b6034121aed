"""Tests that the example and the tables of docs/protocol.md agree with the firmware."""

from __future__ import annotations

import re

from tests.firmware.host_board import FIRMWARE
from tests.firmware.protocol_example import record_example
from tests.firmware.serial_lines import parse_message

DOCUMENT = (FIRMWARE.parent / "docs" / "protocol.md").read_text()


def test_the_documented_example_is_the_program_output() -> None:
    (example,) = re.findall(r"```\n(.*?)\n```", DOCUMENT, re.S)
    assert example.split("\n") == record_example()


def test_the_documented_crc_check_value_is_correct() -> None:
    assert parse_message(b"a 1*" + _crc(b"a 1")).letter == "a"
    assert _crc(b"123456789") == b"29B1" and "29B1" in DOCUMENT


def _crc(data: bytes) -> bytes:
    rest = 0xFFFF
    for byte in data:
        rest ^= byte << 8
        for _ in range(8):
            rest = (rest << 1 ^ 0x1021) & 0xFFFF if rest & 0x8000 else rest << 1
    return b"%04X" % rest


def test_every_flag_and_reason_is_documented() -> None:
    flags = re.findall(r"const Flags \w+ = 1u << (\d+);", (FIRMWARE / "core" / "flags.h").read_text())
    assert len(flags) == 16
    section = DOCUMENT[DOCUMENT.index("**flags**") : DOCUMENT.index("**reason**")]
    for bit in map(int, flags):
        assert f"{1 << bit:04X}" in section
    reasons = re.findall(r"^    [A-Z]+ = (\d+),.*//|^    NONE = (\d+),", _rejection_reasons(), re.M)
    assert len(reasons) == 9
    for number in range(1, 9):
        assert f"{number} " in DOCUMENT[DOCUMENT.index("**reason**") :].split("\n\n")[0]


def _rejection_reasons() -> str:
    text = (FIRMWARE / "core" / "board.h").read_text()
    return text[text.index("enum class Refusal") : text.index("enum class State")]
