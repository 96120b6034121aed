"""What is the wrong way round is reported in a sentence that names the wires."""

import numpy as np
import pytest

from chefbot.calibration.drive import DriveSegment
from chefbot.calibration.wiring import explain_board_message, wiring_fault
from chefbot.maths.se2 import IDENTITY, SE2


def leg(left: float, right: float, seen: SE2, gyro: float) -> DriveSegment:
    ticks = np.array([[0.0, 0.0], [left, right]])
    return DriveSegment(ticks, gyro, 1.0, IDENTITY, seen)


def test_correct_wiring_reports_no_fault() -> None:
    assert wiring_fault(leg(900, 900, SE2(0.15, 0.0, 0.0), 0.0), 0.15, 0.0) is None
    assert wiring_fault(leg(-500, 500, SE2(0.0, 0.0, 0.6), 0.6), 0.0, 0.6) is None
    assert wiring_fault(leg(500, -500, SE2(0.0, 0.0, -0.6), -0.6), 0.0, -0.6) is None


@pytest.mark.parametrize(
    ("measured", "metres", "angle", "expected"),
    [
        (leg(-900, 900, SE2(0.15, 0.0, 0.0), 0.0), 0.15, 0.0, "the left encoder counts against"),
        (leg(900, -900, SE2(0.15, 0.0, 0.0), 0.0), 0.15, 0.0, "the right encoder counts against"),
        (leg(-900, -900, SE2(0.15, 0.0, 0.0), 0.0), 0.15, 0.0, "both encoders"),
        (leg(900, 900, SE2(-0.15, 0.0, 0.0), 0.0), 0.15, 0.0, "backwards when commanded forwards"),
        (leg(-500, 500, SE2(0.0, 0.0, -0.6), -0.6), 0.0, 0.6, "are exchanged"),
        (leg(-500, 500, SE2(0.0, 0.0, 0.6), -0.6), 0.0, 0.6, "upside down"),
    ],
)
def test_each_wiring_fault_has_its_message(
    measured: DriveSegment, metres: float, angle: float, expected: str
) -> None:
    assert expected in (wiring_fault(measured, metres, angle) or "")


def test_encoder_faults_of_the_board_become_instructions() -> None:
    board = "The left encoder is silent or counts against the motor. The motors are off; press STOP."
    assert "swap its wires" in explain_board_message(board, 300, 0)
    assert "counted nothing" in explain_board_message(board, 0, 300)
    assert explain_board_message("The battery is empty. The motors are off.", 9, 9) == "the battery is empty"
