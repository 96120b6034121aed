"""Commands that list what there is, and the comparison of maps."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from chefbot.cli.app import app
from chefbot.cli.board.check import check_board
from chefbot.config import ConfigError
from chefbot.maths.grid import Grid
from chefbot.robot.load import built_in_robots
from chefbot.sim.world.world import built_in_worlds
from chefbot.storage.map_files import save_map


def shown(*arguments: str) -> str:
    done = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_every_world_and_robot_is_listed() -> None:
    assert all(name in shown("world", "list") for name in built_in_worlds())
    assert all(name in shown("robot", "list") for name in built_in_robots())


def test_a_map_is_compared_with_the_truth(tmp_path: Path) -> None:
    cells = np.zeros((40, 60), np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[20, 10:30] = 100
    truth = save_map(tmp_path / "truth", Grid(cells, 0.05, 0.0, 0.0))
    moved = save_map(tmp_path / "moved", Grid(cells, 0.05, 0.2, 0.0))
    out = shown("map", "compare", str(moved), str(truth))
    aligned = next(line for line in out.splitlines() if "aligned" in line)
    assert aligned.split()[1:3] == ["100.0%", "100.0%"]
    assert "x -0.2" in out
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        shown("map", "compare", str(tmp_path / "none.yaml"), str(truth))


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_a_port_where_nothing_answers_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("chefbot.board.autodetect.DETECTION_TIMEOUT_NS", 200_000_000)
    board, port = os.openpty()
    try:
        assert check_board(os.ttyname(port)) == 1
    finally:
        os.close(board)
        os.close(port)
    assert "no motor board answers" in capsys.readouterr().out
