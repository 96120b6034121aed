"""The board's flags and refusal reasons as text (docs/protocol.md)."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class BoardFlag(IntFlag):
    """Bits of the field `flags` of the board's lines."""

    ESTOP_INPUT = 0x0001
    ESTOP_COMMAND = 0x0002
    STALL_LEFT = 0x0004
    STALL_RIGHT = 0x0008
    ENCODER_LEFT = 0x0010
    ENCODER_RIGHT = 0x0020
    BATTERY_EMPTY = 0x0040
    DRIVER_FAULT = 0x0080
    NO_SPEED = 0x0100
    NEUTRAL_FIRST = 0x0200
    LIMITED = 0x0400
    BATTERY_LOW = 0x0800
    IMU_BAD = 0x1000
    ULTRASONIC_ABSENT = 0x2000
    WATCHDOG_RESTART = 0x4000
    NO_SESSION = 0x8000


LATCHED = BoardFlag(0x00FF)
"""Flags that stay set until a clear."""


class BoardState(IntEnum):
    """Values of the field `state` of the board's lines."""

    WAITING = 0
    READY = 1
    DRIVING = 2
    STOPPED = 3


CLEAR = "press STOP, then Release STOP, to clear it"
RELEASE = "release STOP to enable them (press STOP first if the web UI does not offer it)"
FAULT_LATCHED = 6
"""Key of REASONS for a latched fault."""
FAULTS = {
    BoardFlag.ESTOP_INPUT: "the emergency stop button is or was pressed",
    BoardFlag.ESTOP_COMMAND: "it was stopped by an emergency stop command",
    BoardFlag.STALL_LEFT: "the left wheel is blocked",
    BoardFlag.STALL_RIGHT: "the right wheel is blocked",
    BoardFlag.ENCODER_LEFT: "the left encoder is silent or counts against the motor",
    BoardFlag.ENCODER_RIGHT: "the right encoder is silent or counts against the motor",
    BoardFlag.BATTERY_EMPTY: "the battery is empty",
    BoardFlag.DRIVER_FAULT: "a motor driver reports a fault: it is too hot, shorted or short of voltage",
}
WARNINGS = {
    BoardFlag.LIMITED: "the requested speed exceeds the robot's limits; it was scaled down",
    BoardFlag.BATTERY_LOW: "the battery is low",
    BoardFlag.IMU_BAD: "the IMU is absent, stuck or saturated",
    BoardFlag.ULTRASONIC_ABSENT: "no ultrasonic sensor answers",
    BoardFlag.WATCHDOG_RESTART: f"its hardware watchdog restarted it; {CLEAR}",
}
REASONS = {
    1: "its CRC was wrong",
    2: "its form was wrong",
    3: "its number was out of order, or there was no session",
    4: "its letter or its count of fields is unknown",
    5: "its protocol version is another",
    FAULT_LATCHED: "a fault is latched",
    7: "a stop must come first",
    8: "the cause of a fault persists",
}


def faults(flags: int) -> list[str]:
    """Describe the latched faults for which the motors are off."""
    return [description for flag, description in FAULTS.items() if flags & flag]


def motors_off(flags: int) -> list[str]:
    """Describe why the motors are off, and how to clear it; empty while they are not."""
    latched_faults = faults(flags)
    release = RELEASE if flags & LATCHED == BoardFlag.ESTOP_COMMAND else CLEAR
    return [*latched_faults, f"the motors are off; {release}"] if latched_faults else []


def as_text(sentences: list[str]) -> str:
    """Return the descriptions as sentences in one text."""
    return " ".join(f"{s[0].upper()}{s[1:]}." for s in sentences)


def warnings(flags: int) -> list[str]:
    """Describe the conditions under which the board continues to drive."""
    return [description for flag, description in WARNINGS.items() if flags & flag]


def reason(number: int) -> str:
    """Describe why the board refused a line, also for an unknown number."""
    return REASONS.get(number, f"reason {number}, which this program does not know")
