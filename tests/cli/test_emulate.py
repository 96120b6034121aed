"""`chefbot board emulate`: the link of the emulated port, and what prevents it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from chefbot.cli.board.emulate import run_emulator
from chefbot.errors import UserError
from chefbot.robot.errors import RobotFileError
from chefbot.storage.atomic_files import StorageError


def test_a_bad_robot_is_reported_before_a_folder_is_made(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match="nobody"):
        run_emulator("nobody", tmp_path / "new" / "board")
    assert not (tmp_path / "new").exists()


def test_a_file_in_the_place_of_the_link_is_kept(tmp_path: Path) -> None:
    link = tmp_path / "board"
    link.write_text("mine")
    with pytest.raises(UserError, match=f"{link} exists already and is not a link"):
        run_emulator("chefbot", link)
    assert link.read_text() == "mine"


def test_the_link_of_another_board_is_kept(tmp_path: Path) -> None:
    link, port = tmp_path / "board", tmp_path / "tty"
    port.touch()
    link.symlink_to(port)
    with pytest.raises(UserError, match=f"{link} leads to {port}, where another board may be"):
        run_emulator("chefbot", link)
    assert link.resolve() == port


def test_a_folder_that_cannot_be_made_has_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StorageError, match="file"):
        run_emulator("chefbot", tmp_path / "file" / "board")


def test_a_system_without_pseudo_terminals_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "openpty", raising=False)
    with pytest.raises(UserError, match="Linux and macOS only"):
        run_emulator("chefbot", tmp_path / "board")
