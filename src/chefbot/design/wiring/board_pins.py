"""Pins of each motor board, as the firmware's ports use them and as they are printed on the board."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from chefbot.robot.board import CLIFF_INPUTS, MotorBoard


class BoardPins(NamedTuple):
    """A kind of motor board and its pins."""

    port: str
    """Folder of the firmware's port."""
    title: str
    computer: str
    """How the computer is connected to its serial line."""
    pins: Mapping[str, str]
    """Signal of the port's program, printed name of its pin."""
    two_pwm: tuple[tuple[str, str], tuple[str, str]]
    """Signals of left and right motor, forward and backward, for drivers with two PWM inputs."""
    battery_divider: tuple[str, str]
    """Upper and lower resistor."""
    five_volt_encoders: bool
    """Whether its encoder inputs withstand 5 V."""


MEGA_PINS = {
    "RX": "0", "TX": "1", "LEFT_A": "2", "LEFT_B": "3", "RIGHT_A": "18", "RIGHT_B": "19", "SDA": "20", "SCL": "21",
    "LEFT_IN_A": "22", "LEFT_IN_B": "23", "RIGHT_IN_A": "24", "RIGHT_IN_B": "25", "PWM_LEFT": "11", "PWM_RIGHT": "12",
    "BACK_LEFT": "46", "BACK_RIGHT": "45", "ENABLE": "26", "ESTOP": "28", "TRIGGER": "30", "ECHO": "49",
    "BATTERY": "A0", "CLIFF_0": "37", "CLIFF_1": "36", "CLIFF_2": "35", "CLIFF_3": "34", "BUSY": "13",
}  # fmt: skip
TIVA_PINS = {
    "RX": "PA0", "TX": "PA1", "LEFT_A": "PD6", "LEFT_B": "PD7", "RIGHT_A": "PC5", "RIGHT_B": "PC6", "SDA": "PB3",
    "SCL": "PB2", "LEFT_IN_A": "PA3", "LEFT_IN_B": "PA4", "RIGHT_IN_A": "PE4", "RIGHT_IN_B": "PE5", "PWM_LEFT": "PB4",
    "PWM_RIGHT": "PB5", "ENABLE": "PE1", "ESTOP": "PA5", "TRIGGER": "PA7", "ECHO": "PA6", "BATTERY": "PE3",
    "CLIFF_0": "PD0", "CLIFF_1": "PD1", "CLIFF_2": "PD2", "CLIFF_3": "PD3",
}  # fmt: skip
PICO_FIXED_PINS = {"TX": "GP0", "RX": "GP1", "SDA": "GP4", "SCL": "GP5", "BATTERY": "GP26"}


def board_pins(kind: str, board: MotorBoard) -> BoardPins:
    """Return the pins of a kind of motor board, those of a Pico as the robot file has them."""
    if kind == "mega":
        two = (("PWM_LEFT", "BACK_LEFT"), ("PWM_RIGHT", "BACK_RIGHT"))
        title, computer = "Arduino Mega 2560", "USB has these two"
        return BoardPins("arduino_mega", title, computer, MEGA_PINS, two, ("30k", "10k"), True)
    if kind == "tiva":
        two = (("PWM_LEFT", "PWM_RIGHT"), ("RIGHT_IN_A", "RIGHT_IN_B"))
        title, computer = "Tiva C Launchpad EK-TM4C123GXL", "debug USB has these two"
        return BoardPins("tiva_launchpad", title, computer, TIVA_PINS, two, ("47k", "10k"), True)
    two = (("LEFT_IN_A", "LEFT_IN_B"), ("RIGHT_IN_A", "RIGHT_IN_B"))
    moved = board.pins.by_name()
    moved |= {f"cliff_{i}": moved["cliff_0"] + i for i in range(CLIFF_INPUTS)}
    pins = PICO_FIXED_PINS | {name.upper(): f"GP{pin}" for name, pin in moved.items()}
    title, computer = "Raspberry Pi Pico", "USB, or 3.3 V serial here"
    return BoardPins("pico", title, computer, pins, two, ("47k", "10k"), False)
