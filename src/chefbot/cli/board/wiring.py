"""`chefbot board wiring`: draw how a robot's motor board is wired."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from chefbot.cli.board.board_kind import board_kind
from chefbot.design.wiring.board_pins import board_pins
from chefbot.design.wiring.modules import wiring_of
from chefbot.design.wiring.picture import wiring_picture
from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.storage.atomic_files import make_folder, write_atomic

console = Console(highlight=False, soft_wrap=True, markup=False)


def draw_wiring(robot_file: str, kind: str, out: Path) -> None:
    """Write the picture of the wiring as SVG. Raises UserError for an unknown board or a drive without one."""
    robot = load_robot(robot_file)
    if robot.drive.protocol:
        raise UserError(f"{robot.name} has no motor board: its drive, {robot.drive.protocol}, has its own")
    kind = board_kind(kind, robot)
    wiring = wiring_of(robot, kind, board_pins(kind, robot.board))
    make_folder(out.parent)
    write_atomic(out, wiring_picture(wiring).encode())
    console.print(f"{out}: {wiring.board.title}, drivers with {robot.driver.inputs}")
    for note in wiring.notes:
        console.print(note)
