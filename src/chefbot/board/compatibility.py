"""Whether a board may drive a robot: what its handshake says against the robot file."""

from __future__ import annotations

from chefbot.board.firmware_constants import as_int32, firmware_constants
from chefbot.board.messages import PROTOCOL, OtherVersion, Version
from chefbot.robot.spec import Robot

LIMITS = ("max_wheel", "max_forward", "max_turn", "acceleration")


def refusal(answer: Version | OtherVersion, robot: Robot) -> str | None:
    """The sentence with which a board is refused, None if it may drive."""
    if isinstance(answer, OtherVersion):
        return (
            f"the board speaks version {answer.protocol} of the protocol, this program speaks version {PROTOCOL}; "
            "flash the firmware that came with this program, with `chefbot flash`"
        )
    wanted = round(1000 * robot.motor.ticks_per_turn)
    if answer.ticks_per_turn_milli != wanted:
        return (
            f"the board counts {answer.ticks_per_turn_milli / 1000:g} ticks per turn of a wheel, the robot "
            f"{robot.name} has {wanted / 1000:g}: it would drive at the wrong speed; flash this robot's firmware, "
            "with `chefbot flash`, or launch with the robot it was made for"
        )
    return None


def differences(answer: Version, robot: Robot) -> str | None:
    """What a board that may drive knows otherwise, as a sentence; None if it was made for this robot file."""
    constants = {constant.name: constant.value for constant in firmware_constants(robot)}
    if as_int32(answer.hash) == as_int32(constants["hash"]):
        return None
    other = [
        f"{name} {getattr(answer, name)} instead of {constants[name]} ticks/s{'^2' * (name == 'acceleration')}"
        for name in LIMITS
        if getattr(answer, name) != constants[name]
    ]
    what = "; ".join(other) if other else "battery voltages, motor figures or sensor rates"
    return f"the board's firmware was made from another robot file ({what}): the board's own figures hold"
