"""The constants of the motor board's firmware as a C header."""

from __future__ import annotations

from chefbot.board.firmware_constants import FirmwareConstant, as_int32, firmware_constants
from chefbot.robot.spec import Robot


def firmware_header(robot: Robot) -> str:
    """Return the text of `robot_constants.h`: the constants and an initialiser of their struct, and the pins."""
    constants = firmware_constants(robot)
    lines = [
        f"// Firmware constants of the robot {robot.name}, made from its robot file: do not edit.",
        "#pragma once",
        "",
        f'#define CHEFBOT_ROBOT_NAME "{robot.name}"',
        *(_define(constant) for constant in constants),
        "",
        f"#define CHEFBOT_DRIVER_INPUTS {robot.driver.inputs.upper()}  // driver.inputs",
        *(
            f"#define CHEFBOT_GP_{n.upper()} {pin}  // board.pins"
            for n, pin in robot.board.pins.by_name().items()
        ),
        "",
        "// in the order of struct RobotConstants",
        "#define CHEFBOT_ROBOT_CONSTANTS { \\",
        *(f"    {_macro(constant)}, \\" for constant in constants),
        "}",
    ]
    return "\n".join(lines) + "\n"


def _macro(constant: FirmwareConstant) -> str:
    return f"CHEFBOT_{constant.name.upper()}"


def _define(constant: FirmwareConstant) -> str:
    return f"#define {_macro(constant)} {as_int32(constant.value)}L  // {constant.unit}; {constant.source}"
