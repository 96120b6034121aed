"""Which kind of motor board a command is about: an option, or that of the robot file."""

from __future__ import annotations

from chefbot.errors import UserError, name_hint
from chefbot.robot.board import BOARD_LOGIC
from chefbot.robot.spec import Robot


def board_kind(given: str, robot: Robot) -> str:
    """Return the given kind of board, or that of the robot file. Raises UserError for an unknown kind or none."""
    kind = given or robot.board.kind
    if not kind:
        raise UserError("give the board: --board mega, tiva or pico, or board: {kind: ...} in the robot file")
    if kind not in BOARD_LOGIC:
        raise UserError(f"no board is called {kind!r}{name_hint(kind, BOARD_LOGIC)}")
    if robot.board.kind and kind != robot.board.kind:
        raise UserError(f"the robot {robot.name} has the board {robot.board.kind} in its file, not {kind}")
    return kind
