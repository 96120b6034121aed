"""The board on the bench: one that does not answer, one of another robot, and a session that has ended."""

from __future__ import annotations

import os
import time
import tty
from contextlib import closing
from pathlib import Path

import pytest
from tests.devices.emulated import Emulator
from tests.support.waiting import wait_for

from chefbot.board.messages import MotionLine
from chefbot.devices import bench_board
from chefbot.devices.bench_board import BenchBoard
from chefbot.devices.serial_ports import open_port
from chefbot.errors import UserError
from chefbot.robot.load import load_robot

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")


def test_a_board_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_board, "OPEN_NS", 300_000_000)
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    with open_port(os.ttyname(theirs)) as port, pytest.raises(UserError, match="no motor board answers"):
        BenchBoard(port, load_robot("chefbot")).open()
    os.close(ours)
    os.close(theirs)


def test_a_board_of_another_robot_is_refused(tmp_path: Path) -> None:
    emulated = Emulator(tmp_path, "desk")
    with closing(emulated), open_port(str(emulated.path)) as port, pytest.raises(UserError, match="ticks"):
        BenchBoard(port, load_robot("chefbot")).open()


@pytest.mark.slow
def test_a_session_that_has_ended_is_begun_again(tmp_path: Path) -> None:
    with closing(Emulator(tmp_path)) as emulated, open_port(str(emulated.path)) as port:
        board = BenchBoard(port, load_robot("chefbot"))
        board.open()
        time.sleep(1.5)  # a question waits: the board ends a session after a second

        def drives() -> bool:
            lines = [line for line in board.run(1.0, 2.0, 2.0) if isinstance(line, MotionLine)]
            return board.session.is_open and lines[-1].left > lines[0].left

        wait_for(drives)  # a busy computer may let the command time out
