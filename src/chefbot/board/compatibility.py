"""Compatibility check: compares what a board reports in its handshake with the robot file."""

from __future__ import annotations

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.board.messages import PROTOCOL, UnsupportedVersionLine, VersionLine
from chefbot.robot.spec import Robot

LIMITS = ("max_wheel", "max_forward", "max_turn", "acceleration")


def incompatibility(answer: VersionLine | UnsupportedVersionLine, robot: Robot) -> str | None:
    """Return why a board must not drive this robot, as a sentence; None if it may."""
    if isinstance(answer, UnsupportedVersionLine):
        return (
            f"the board uses protocol version {answer.protocol}, this program uses version {PROTOCOL}; "
            "flash the firmware that came with this program, with `chefbot board flash`"
        )
    # A wrong number of ticks per turn would scale all speeds.
    expected = round(1000 * robot.motor.ticks_per_turn)
    if answer.ticks_per_turn_milli != expected:
        return (
            f"the board counts {answer.ticks_per_turn_milli / 1000:g} ticks per turn of a wheel, the robot "
            f"{robot.name} has {expected / 1000:g}: it would drive at the wrong speed; flash this robot's firmware, "
            "with `chefbot board flash`, or launch with the robot it was made for"
        )
    return None


def constant_differences(answer: VersionLine, robot: Robot) -> str | None:
    """Describe how a compatible board's constants differ from the robot file; None if they are equal."""
    constants = {constant.name: constant.value for constant in firmware_constants(robot)}
    # Equal hashes mean equal constants; otherwise name the limits that differ.
    if as_int32(answer.hash) == as_int32(constants["hash"]):
        return None
    changed = [
        f"{name} {getattr(answer, name)} instead of {constants[name]} ticks/s{'^2' * (name == 'acceleration')}"
        for name in LIMITS
        if getattr(answer, name) != constants[name]
    ]
    details = (
        "; ".join(changed) if changed else "deceleration, battery voltages, motor figures or sensor rates"
    )
    return (
        f"the board's firmware was made from another robot file ({details}): the board's own constants are used "
        "until `chefbot board flash` gives it those of this robot"
    )
