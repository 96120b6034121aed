"""Detection of reversed motor leads, encoder wires or gyro from a first slow motion."""

from __future__ import annotations

from chefbot.calibration.drive import DriveSegment
from chefbot.msgs.diagnostic_msgs import ERROR, DiagnosticArray

SIDES = ("left", "right")
MIN_TICKS = 20
MIN_ROTATION = 0.1  # rad
MIN_TRANSLATION = 0.03  # m


def wiring_fault(leg: DriveSegment, metres: float, angle: float) -> str | None:
    """Return a wiring fault, or None if a motion of `metres` ahead or `angle` rad to the left is as
    commanded."""
    reversed_sides = _reversed_sides(leg, (metres, metres) if metres else (-angle, angle))
    if len(reversed_sides) == 2:
        return (
            "both encoders count against their motors: swap the wires A and B of each, or both motors' leads"
        )
    if reversed_sides:
        return _encoder_advice(SIDES[reversed_sides[0]])
    # Encoders agree with the motors: compare with the motion by the scans
    if metres and leg.seen.x * metres < 0.0 and abs(leg.seen.x) > MIN_TRANSLATION:
        return (
            "the robot drives backwards when commanded forwards: swap leads and encoder wires of both motors"
        )
    if angle and leg.seen.yaw * angle < 0.0 and abs(leg.seen.yaw) > MIN_ROTATION:
        return "the robot turns right when commanded left: the two motors, with their encoders, are exchanged"
    if angle and leg.gyro * leg.seen.yaw < 0.0 and abs(leg.gyro) > MIN_ROTATION:
        return "the gyro turns against the scans: the IMU is mounted upside down; turn it over"
    return None


def _reversed_sides(leg: DriveSegment, commanded: tuple[float, float]) -> list[int]:
    """Return the sides, 0 and 1, whose encoders counted against the command."""
    counted = leg.ticks[-1] - leg.ticks[0]
    return [side for side in (0, 1) if counted[side] * commanded[side] < 0 and abs(counted[side]) > MIN_TICKS]


def _encoder_advice(side: str) -> str:
    return (
        f"the {side} encoder counts against its motor: swap its wires A and B, or the two leads of the motor"
    )


def board_error(array: DiagnosticArray) -> str:
    """Return the message of the board's first error in the diagnostics, or an empty string."""
    errors = [one.message for one in array.status if one.name == "board" and one.level == ERROR]
    return errors[0] if errors else ""


def explain_board_message(board: str, left: int, right: int) -> str:
    """Return the board's first sentence, with advice if it reports an encoder fault.

    left, right: ticks counted by the encoders during the motion.
    """
    first = board.split(". ")[0].rstrip(".")
    message = first[:1].lower() + first[1:]
    for side, counted in zip(SIDES, (left, right), strict=True):
        if message.startswith(f"the {side} encoder"):
            silent = f"{message}; it counted nothing: look at its plug"
            return _encoder_advice(side) if counted > MIN_TICKS else silent
    return message
