"""Which motor leads, encoder wires or gyro are the wrong way round, from a first careful motion."""

from __future__ import annotations

from chefbot.calibration.drive import Leg

SIDES = ("left", "right")
LEAST_TICKS = 20
LEAST_TURN = 0.1  # rad
LEAST_SHIFT = 0.03  # m


def miswired(leg: Leg, metres: float, angle: float) -> str | None:
    """A sentence, or None if a motion of `metres` straight on or `angle` rad to the left came out as wanted."""
    counted = leg.ticks[-1] - leg.ticks[0]
    wanted = (metres, metres) if metres else (-angle, angle)
    against = [
        side for side in (0, 1) if counted[side] * wanted[side] < 0 and abs(counted[side]) > LEAST_TICKS
    ]
    if against:
        return (
            _wheel(SIDES[against[0]])
            if len(against) == 1
            else (
                "both encoders count against their motors: swap the wires A and B of each, or both motors' leads"
            )
        )
    if metres and leg.seen.x * metres < 0.0 and abs(leg.seen.x) > LEAST_SHIFT:
        return "the robot drives backwards when told forwards: swap leads and encoder wires of both motors"
    if angle and leg.seen.yaw * angle < 0.0 and abs(leg.seen.yaw) > LEAST_TURN:
        return "the robot turns right when told left: the two motors, with their encoders, are exchanged"
    if angle and leg.gyro * leg.seen.yaw < 0.0 and abs(leg.gyro) > LEAST_TURN:
        return "the gyro turns against the scans: the IMU is mounted upside down; turn it over"
    return None


def _wheel(side: str) -> str:
    return (
        f"the {side} encoder counts against its motor: swap its wires A and B, or the two leads of the motor"
    )


def explained(board: str, left: int, right: int) -> str:
    """The board's own first sentence, and what to do where it blames an encoder that counted so many ticks."""
    first = board.split(". ")[0].rstrip(".")
    told = first[:1].lower() + first[1:]
    for side, counted in zip(SIDES, (left, right), strict=True):
        if told.startswith(f"the {side} encoder"):
            return _wheel(side) if counted > LEAST_TICKS else f"{told}; it counted nothing: look at its plug"
    return told
