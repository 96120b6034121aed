"""Tests that the wiring pictures and the table in the README have the pins of the ports' source code."""

from __future__ import annotations

import re
import runpy
from typing import Any

import pytest

from tests.firmware.host_board import FIRMWARE

WIRING: dict[str, Any] = runpy.run_path(str(FIRMWARE.parent / "docs" / "wiring.py"))
BOARDS = ("mega", "tiva", "pico")
README = (FIRMWARE / "README.md").read_text()
ROWS = {
    "computer": (),
    "left encoder A, B": ("LEFT_A", "LEFT_B"),
    "right encoder A, B": ("RIGHT_A", "RIGHT_B"),
    "left motor INA, INB, PWM": ("LEFT_IN_A", "LEFT_IN_B", "PWM_LEFT"),
    "right motor INA, INB, PWM": ("RIGHT_IN_A", "RIGHT_IN_B", "PWM_RIGHT"),
    "drivers' enable": ("ENABLE",),
    "e-stop": ("ESTOP",),
    "ultrasonic trigger, echo": ("TRIGGER", "ECHO"),
    "first cliff sensor": ("CLIFF_0",),
    "IMU SDA, SCL": ("SDA", "SCL"),
    "battery, divided": ("BATTERY",),
    "busy light": (),
}


def code(board: str) -> str:
    """Return the port's source code without comments and without its pin table."""
    text = re.sub(r"//.*", "", WIRING["source"](WIRING["BOARDS"][board]))
    return re.sub(r"enum Pin : uint\d+_t \{.*?\}", "", text, flags=re.S)


@pytest.mark.parametrize("board", BOARDS)
def test_the_wiring_picture_has_the_pins_of_the_source(board: str) -> None:
    picture = FIRMWARE.parent / "docs" / "pictures" / f"wiring_{board}.svg"
    assert picture.read_text() == WIRING["draw"](board), "run python docs/wiring.py to update the picture"
    assert f"docs/pictures/{picture.name}" in README
    for pin in set(WIRING["pins"](board).values()) - {"13"}:  # the LED on the Mega needs no wire
        assert f">{pin}</text>" in picture.read_text()


@pytest.mark.parametrize("board", BOARDS)
def test_the_program_takes_its_pins_from_the_table(board: str) -> None:
    """The exceptions are pins that the chip fixes: serial line, I2C bus, and channels of timers and converters."""
    fixed = {"mega": {"RX", "TX", "SDA", "SCL", "ECHO"}, "tiva": set(), "pico": {"LEFT_B", "RIGHT_A"}}[board]
    used = {name for name in WIRING["pins"](board) if re.search(rf"\b{name}\b", code(board))}
    assert set(WIRING["pins"](board)) - used <= fixed
    assert not re.search(r"1 << P[A-L]\d", code(board))


@pytest.mark.parametrize("board", BOARDS)
def test_no_pin_is_used_twice(board: str) -> None:
    pins = WIRING["pins"](board)
    assert len(set(pins.values())) == len(pins) >= 19


@pytest.mark.parametrize("column, board", list(enumerate(BOARDS)))
def test_the_readme_table_has_the_pins_of_the_source(column: int, board: str) -> None:
    rows = [line.strip("| ").split(" | ") for line in README.splitlines() if line.startswith("| ")]
    table = {row[0]: row[1 + column] for row in rows if row[0] in ROWS}
    assert set(table) == set(ROWS)
    pins = WIRING["pins"](board)
    for row, signals in ROWS.items():
        found = re.findall(r"\b(?:P[A-F]\d|GP\d+|A\d|\d+)\b(?!k)", table[row].partition(" through")[0])
        assert not signals or found == [pins[signal] for signal in signals], row


@pytest.mark.parametrize(
    "board, full, steps", [("mega", 5000, 1024), ("tiva", 3300, 4096), ("pico", 3300, 4096)]
)
def test_the_battery_divider_matches_the_program(board: str, full: int, steps: int) -> None:
    upper, lower = (int(ohms[:-1]) for ohms in WIRING["battery_divider"](board))
    (found,) = re.findall(r"\* (\d+)(?:UL)? (/|>>) (\d+)\)", code(board))
    factor = int(found[0]) / (int(found[2]) if found[1] == "/" else 1 << int(found[2]))
    assert factor == pytest.approx(full / steps * (upper + lower) / lower, rel=1e-3)
    assert 13_000 * lower / (upper + lower) < full  # a fully charged battery can be measured


@pytest.mark.parametrize("board", BOARDS)
def test_no_3v3_input_gets_the_5v_of_the_ranger(board: str) -> None:
    kind = WIRING["BOARDS"][board]
    assert ("ECHO" in kind.divided) == (kind.logic == "3.3 V")
    assert WIRING["draw"](board).count(">2k<") == len(kind.divided)
