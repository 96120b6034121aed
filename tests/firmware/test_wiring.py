"""Tests that wiring pictures and the table in the README have the pins that the firmware's ports use."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from chefbot.board.firmware_constants import firmware_constants
from chefbot.cli.board.board_kind import board_kind
from chefbot.cli.board.wiring import draw_wiring
from chefbot.design.wiring.board_pins import BoardPins, board_pins
from chefbot.design.wiring.modules import wiring_of
from chefbot.design.wiring.picture import wiring_picture
from chefbot.errors import ChefbotError, UserError
from chefbot.robot.board import BOARD_LOGIC, MotorBoard, PicoPins
from chefbot.robot.load import load_robot
from tests.firmware.host_board import FIRMWARE
from tests.support.wirings import WIRINGS, wired

BOARDS = ("mega", "tiva", "pico")
README = (FIRMWARE / "README.md").read_text()
ROBOT = load_robot("chefbot_cliff")
ROWS = {
    "computer": (),
    "left encoder A, B": ("LEFT_A", "LEFT_B"),
    "right encoder A, B": ("RIGHT_A", "RIGHT_B"),
    "left motor INA, INB, PWM": ("LEFT_IN_A", "LEFT_IN_B", "PWM_LEFT"),
    "right motor INA, INB, PWM": ("RIGHT_IN_A", "RIGHT_IN_B", "PWM_RIGHT"),
    "left motor DIR, PWM": ("LEFT_IN_A", "PWM_LEFT"),
    "right motor DIR, PWM": ("RIGHT_IN_A", "PWM_RIGHT"),
    "left motor IN1, IN2": (),
    "right motor IN1, IN2": (),
    "drivers' enable": ("ENABLE",),
    "e-stop": ("ESTOP",),
    "ultrasonic trigger, echo": ("TRIGGER", "ECHO"),
    "cliff sensors": ("CLIFF_0", "CLIFF_1", "CLIFF_2", "CLIFF_3"),
    "IMU SDA, SCL": ("SDA", "SCL"),
    "battery, divided": ("BATTERY",),
    "busy light": (),
}
MEGA_TERMINALS = {
    "PE0": "0", "PE1": "1", "PE4": "2", "PE5": "3", "PD3": "18", "PD2": "19", "PD1": "20", "PD0": "21",
    "PA0": "22", "PA1": "23", "PA2": "24", "PA3": "25", "PA4": "26", "PA6": "28", "PC7": "30", "PL0": "49",
    "PC0": "37", "PB5": "11", "PB6": "12", "PB7": "13", "PF0": "A0", "PL3": "46", "PL4": "45",
}  # fmt: skip
"""What is printed on an Arduino Mega 2560 beside the chip's pins (its schematic)."""


def source(board: BoardPins) -> str:
    return (FIRMWARE / "ports" / board.port / "main.cpp").read_text()


def pins_of_the_source(kind: str) -> dict[str, str]:
    """Return the printed name of each signal's pin by the enumeration in the port's source code.

    Those of a Pico are in it only if they cannot be moved; the others come with the robot.
    """
    (table,) = re.findall(r"enum Pin : uint\d+_t \{(.*?)\}", source(board_pins(kind, MotorBoard())), re.S)
    found = dict(re.findall(r"(\w+) = ([A-Z0-9_ +]+?)\s*(?:,|$)", table.strip()))
    return {signal: printed(kind, signal, place) for signal, place in found.items()}


def printed(kind: str, signal: str, place: str) -> str:
    if kind == "mega":
        return MEGA_TERMINALS[place]
    if kind == "tiva":
        return "P" + place.replace(" + ", "")
    return f"GP{place}"


def code(board: BoardPins) -> str:
    """Return the port's source code without comments and without its pin table."""
    text = re.sub(r"//.*", "", source(board))
    return re.sub(r"enum Pin : uint\d+_t \{.*?\}", "", text, flags=re.S)


@pytest.mark.parametrize("kind", BOARDS)
def test_the_pin_table_is_that_of_the_source(kind: str) -> None:
    pins = dict(board_pins(kind, MotorBoard()).pins)
    for i in (1, 2, 3):
        del pins[f"CLIFF_{i}"]
    assert len(set(pins.values())) == len(pins) >= 19
    for signal in PicoPins().by_name() if kind == "pico" else ():
        del pins[signal.upper()]
    assert pins == pins_of_the_source(kind)


@pytest.mark.parametrize("kind", BOARDS)
def test_the_wiring_picture_is_up_to_date(kind: str) -> None:
    picture = FIRMWARE.parent / "docs" / "pictures" / f"wiring_{kind}.svg"
    drawn = wiring_picture(wiring_of(ROBOT, kind, board_pins(kind, ROBOT.board)))
    assert picture.read_text() == drawn, (
        f"chefbot board wiring --robot {ROBOT.name} --board {kind} --out {picture}"
    )
    assert f"docs/pictures/{picture.name}" in README


@pytest.mark.parametrize("wiring", ["dir_pwm", "two_pwm", "pins"])
@pytest.mark.parametrize("kind", BOARDS)
def test_every_wire_of_a_robot_has_a_pin_of_its_own(kind: str, wiring: str, tmp_path: Path) -> None:
    robot = load_robot(wired(wiring, tmp_path))
    if robot.board.kind not in ("", kind):
        pytest.skip(f"a robot with a {robot.board.kind}")
    board = board_pins(kind, robot.board)
    drawn = wiring_of(robot, kind, board)
    pins = [board.pins[signal] for module in (*drawn.left, *drawn.right) for signal, _ in module.wires]
    assert len(set(pins)) == len(pins) and all(f">{pin}</text>" in wiring_picture(drawn) for pin in pins)


def test_what_no_wire_shows_is_written(tmp_path: Path) -> None:
    robot = load_robot(wired("two_pwm", tmp_path))
    notes = " ".join(wiring_of(robot, "pico", board_pins("pico", robot.board)).notes)
    assert "one for each motor" in notes and "IN1 high" in notes and "3.15 V and more as high" in notes
    path = tmp_path / "robot.yaml"
    path.write_text("like: chefbot\nname: robot\ndriver: drv8871\n")
    robot = load_robot(str(path))
    drawn = wiring_of(robot, "mega", board_pins("mega", robot.board))
    assert "must cut their supply" in " ".join(drawn.notes) and ">26</text>" not in wiring_picture(drawn)
    path.write_text("like: chefbot\nname: robot\ndriver: drv8833\n")
    robot = load_robot(str(path))
    assert "the driver stands 10.8 V" in " ".join(
        wiring_of(robot, "mega", board_pins("mega", robot.board)).notes
    )


@pytest.mark.parametrize("kind", BOARDS)
def test_the_program_takes_its_pins_from_the_table(kind: str) -> None:
    """The exceptions are pins that the chip fixes: serial line, I2C bus, and channels of timers and converters."""
    fixed = {"mega": {"RX", "TX", "SDA", "SCL", "ECHO"}, "tiva": set(), "pico": set()}[kind]
    board, names = board_pins(kind, MotorBoard()), set(pins_of_the_source(kind))
    used = {name for name in names if re.search(rf"\b{name}\b", code(board))}
    assert names - used <= fixed
    assert not re.search(r"1 << P[A-L]\d", code(board))


@pytest.mark.parametrize("column, kind", list(enumerate(BOARDS)))
def test_the_readme_table_has_the_pins_of_the_ports(column: int, kind: str) -> None:
    rows = [line.strip("| ").split(" | ") for line in README.splitlines() if line.startswith("| ")]
    table = {row[0]: row[1 + column] for row in rows if row[0] in ROWS}
    assert set(table) == set(ROWS)
    board = board_pins(kind, MotorBoard())
    signals = ROWS | {f"{side} motor IN1, IN2": board.two_pwm[i] for i, side in enumerate(("left", "right"))}
    for row, names in signals.items():
        found = re.findall(r"\b(?:P[A-F]\d|GP\d+|A\d|\d+)\b(?!k)", table[row].partition(" through")[0])
        assert not names or found == [board.pins[name] for name in names], row


@pytest.mark.parametrize(
    "kind, full, steps", [("mega", 5000, 1024), ("tiva", 3300, 4096), ("pico", 3300, 4096)]
)
def test_the_battery_divider_matches_the_program(kind: str, full: int, steps: int) -> None:
    board = board_pins(kind, MotorBoard())
    upper, lower = (int(ohms[:-1]) for ohms in board.battery_divider)
    (found,) = re.findall(r"\* (\d+)(?:UL)? (/|>>) (\d+)\)", code(board))
    factor = int(found[0]) / (int(found[2]) if found[1] == "/" else 1 << int(found[2]))
    assert factor == pytest.approx(full / steps * (upper + lower) / lower, rel=1e-3)
    assert 13_000 * lower / (upper + lower) < full  # a fully charged battery can be measured


@pytest.mark.parametrize("kind", BOARDS)
def test_no_3v3_input_gets_the_5v_of_the_ranger(kind: str) -> None:
    drawn = wiring_of(ROBOT, kind, board_pins(kind, ROBOT.board))
    assert ("ECHO" in drawn.divided) == (BOARD_LOGIC[kind] < 5.0)
    assert wiring_picture(drawn).count(">2k<") == len(drawn.divided)


@pytest.mark.parametrize(
    ("board", "problem"),
    [
        ("{kind: uno}", "board.kind: unknown 'uno'"),
        ("{at_rest: roll}", "board.at_rest: unknown 'roll'"),
        ("{kind: mega, pins: {estop: 3}}", "board.pins: only those of a Pico"),
        ("{kind: pico, pins: {estop: 4}}", "board.pins.estop: GP4 is taken by the IMU"),
        ("{kind: pico, pins: {estop: 2}}", "board.pins.estop: GP2 is taken by trigger"),
        ("{kind: pico, pins: {cliff_0: 20}}", "board.pins.cliff_0: GP23 is not free"),
        ("{kind: pico, pins: {left_a: 22}}", "board.pins.left_a: the pin behind it, GP23, must be left_b"),
        ("{kind: pico, pins: {estop: 28}}", "board.pins.estop: GP28 is not free"),
        ("{kind: pico, pins: {left_a: 16, left_b: 6, pwm_left: 22}}", "board.pins.left_a: "),
        ("{kind: pico, pins: {estop: 22, left_in_b: 6}}", "board.pins.left_in_b: GP6 is taken by left_a"),
        (
            "{kind: pico, pins: {left_a: 10, left_b: 11, left_in_a: 6, left_in_b: 22}}",
            "left_in_a: GP6 has the same PWM channel as left_in_b",
        ),
    ],
)
def test_a_board_that_cannot_be_wired_has_one_sentence(board: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(f"like: chefbot\nname: robot\nboard: {board}\n")
    with pytest.raises(ChefbotError, match=re.escape(problem)):
        load_robot(str(path))


def test_the_board_of_the_robot_file_is_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    draw_wiring(wired("pins", tmp_path), "", tmp_path / "out" / "wiring.svg")
    assert "Raspberry Pi Pico" in capsys.readouterr().out
    assert ">GP20</text>" in (tmp_path / "out" / "wiring.svg").read_text()
    for robot, kind, reason in (
        ("chefbot", "", "give the board"),
        ("chefbot", "uno", "no board is called 'uno'"),
    ):
        with pytest.raises(UserError, match=reason):
            draw_wiring(robot, kind, tmp_path / "wiring.svg")


def test_an_option_does_not_contradict_the_robot_file(tmp_path: Path) -> None:
    robot = load_robot(wired("pins", tmp_path))
    assert board_kind("", robot) == board_kind("pico", robot) == "pico"
    assert board_kind("tiva", ROBOT) == "tiva"
    with pytest.raises(UserError, match="has the board pico"):
        board_kind("mega", robot)


def test_pins_that_a_robot_does_not_use_are_free(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    text = "like: chefbot\nname: robot\ndriver: ibt2_bts7960\nboard: {kind: pico, pins: {left_a: 16, left_b: 17}}\n"
    path.write_text(text)
    assert load_robot(str(path)).board.pins.left_a == 16
    path.write_text(text.replace("ibt2_bts7960", "pololu_dual_vnh5019"))
    with pytest.raises(ChefbotError, match="GP16 is taken by pwm_left"):
        load_robot(str(path))


def test_pins_may_have_the_names_on_the_board(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    text = "like: chefbot\nname: robot\nboard: {kind: pico, pins: {estop: GP22, left_a: 20, left_b: GP21}}\n"
    path.write_text(text)
    pins = load_robot(str(path)).board.pins
    assert (pins.estop, pins.left_a, pins.left_b) == (22, 20, 21)
    path.write_text(text.replace("GP22", "D7"))
    with pytest.raises(ChefbotError, match=r"board\.pins\.estop"):
        load_robot(str(path))


def test_a_moved_pin_is_another_firmware(tmp_path: Path) -> None:
    hashes = {firmware_constants(load_robot(wired(name, tmp_path)))[0].value for name in WIRINGS}
    assert len(hashes | {firmware_constants(load_robot("chefbot"))[0].value}) == 1 + len(WIRINGS)
