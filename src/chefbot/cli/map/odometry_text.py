"""Systematic errors of a robot's odometry as a sentence, for its owner to correct the robot file."""

from __future__ import annotations

import math

from chefbot.slam.systematic_errors import SystematicErrors


def odometry_text(errors: SystematicErrors | None) -> str:
    """Return by how much odometry measures distances and turns wrong, and how far its heading drifts."""
    if errors is None:
        return "The drive is too short to show errors of odometry."
    distance = _share(errors.distance, "long", "short")
    turn = _share(errors.turn, "large", "small")
    # what the robot turns to the left beyond odometry, odometry drifts to the right
    drift, side = math.degrees(errors.bend), "right" if errors.bend > 0.0 else "left"
    drifts = f"drifts {abs(drift):.2f}° per metre to the {side}"
    return f"Odometry measures distances {distance} and turns {turn}, and {drifts}."


def _share(factor: float, more: str, less: str) -> str:
    """Return by how much a measurement is wrong whose true value is a factor times it."""
    error = 1.0 / factor - 1.0
    return f"{abs(error):.1%} too {more if error > 0.0 else less}"
