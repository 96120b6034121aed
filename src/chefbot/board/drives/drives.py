"""Motor drives by the name that a robot file gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

from chefbot.board.drives.ddsm115 import Ddsm115Link, speed_request
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


DRIVES: Mapping[str, MotorDrive] = {
    "roboclaw": MotorDrive("RoboClaw", RoboClawLink, version_request),
    "ddsm115": MotorDrive("DDSM115 motors", Ddsm115Link, partial(speed_request, 0, 0)),
}
