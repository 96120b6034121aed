"""`chefbot board image`, and the program that `chefbot board flash` writes: the firmware for one robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

import chefbot.board
from chefbot.board.firmware_constants import firmware_constants
from chefbot.board.firmware_image import FirmwareImageError, intel_hex, uf2, with_robot
from chefbot.cli.board.board_kind import board_kind
from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.robot.spec import Robot
from chefbot.storage.atomic_files import write_into_folder

IMAGES = Path(chefbot.board.__file__).parent / "images"
"""Programs without a robot, compiled by `make -C firmware images`."""

console = Console(highlight=False, soft_wrap=True, markup=False)


class ImageFormat(NamedTuple):
    """The file format that the flashing tools of a board take."""

    suffix: str
    convert: Callable[[bytes], bytes]


FORMATS = {
    "mega": ImageFormat(".hex", intel_hex),
    "tiva": ImageFormat(".bin", bytes),
    "pico": ImageFormat(".uf2", uf2),
}


class FirmwareImage(NamedTuple):
    """The firmware of one robot for one kind of board."""

    board: str
    robot: Robot
    file_name: str
    data: bytes


def firmware_image(kind: str, robot_file: str, program: Path | None) -> FirmwareImage:
    """Return the firmware with the robot filled in, in the format of the board's tools.

    program: a program compiled by the user; None: that of the package. Raises UserError for an unknown board,
    a robot without motor board, or a program that cannot be read or is not one.
    """
    robot = load_robot(robot_file)
    if robot.drive.protocol:
        raise UserError(
            f"{robot.name} has no motor board: its drive, {robot.drive.protocol}, has its own firmware"
        )
    board = board_kind(kind, robot)
    data = _converted(program or IMAGES / f"{board}.bin", robot, board)
    return FirmwareImage(board, robot, f"{robot.name}_{board}{FORMATS[board].suffix}", data)


def _converted(program: Path, robot: Robot, board: str) -> bytes:
    try:
        return FORMATS[board].convert(with_robot(program.read_bytes(), robot, board))
    except OSError as error:
        raise UserError(f"the program {program} cannot be read: {error.strerror}") from None
    except FirmwareImageError as error:
        raise UserError(f"the program {program} cannot be used: {error}") from None


def run_image(kind: str, robot_file: str, program: Path | None, out: Path | None) -> None:
    """Write the firmware for a robot to a file, for other tools than those of `chefbot board flash`."""
    image = firmware_image(kind, robot_file, program)
    path = out or Path("runs") / image.file_name
    if path.suffix != FORMATS[image.board].suffix:
        raise UserError(
            f"--out {path}: the tools of the {image.board} take a file {FORMATS[image.board].suffix}"
        )
    write_into_folder(path, image.data)
    table = Table("constant", "value", "unit", "from")
    for constant in firmware_constants(image.robot):
        table.add_row(constant.name, str(constant.value), constant.unit, constant.source)
    for name, pin in image.robot.board.pins.moved().items():
        table.add_row(name, f"GP{pin}", "pin", "board.pins")
    console.print(table)
    console.print(f"{path}: firmware for the {image.board}, driver inputs {image.robot.driver.inputs}")
