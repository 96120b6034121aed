"""Motor drives by the name that a robot file gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from chefbot.board.drives.ddsm115 import IDS, Ddsm115Link, crc8, speed_frame
from chefbot.board.drives.drive_link import DriveLink
from chefbot.board.drives.half_duplex import LineRequest
from chefbot.board.drives.roboclaw import RoboClawLink, version_request
from chefbot.robot.spec import Robot


class MotorDrive(NamedTuple):
    """How to communicate with a motor drive.

    title: for people. link: begins the communication. greeting: a request that moves nothing and that each answers.
    """

    title: str
    link: Callable[[Robot], DriveLink]
    greeting: Callable[[], LineRequest]


def _standing() -> LineRequest:
    return LineRequest(
        "greeting",
        speed_frame(IDS[0], 0),
        lambda _: 10,
        lambda answer: answer[0] == IDS[0] and crc8(answer[:-1]) == answer[-1],
    )


DRIVES: Mapping[str, MotorDrive] = {
    "roboclaw": MotorDrive("RoboClaw", RoboClawLink, version_request),
    "ddsm115": MotorDrive("DDSM115 motors", Ddsm115Link, _standing),
}
