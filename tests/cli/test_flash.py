"""`chefbot board flash` with stand-ins of make, the compiler and the tool on the PATH."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.cli.board.flash import TARGETS, firmware_folder, run_flash
from chefbot.errors import UserError
from chefbot.robot.errors import RobotFileError


@pytest.fixture
def tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty PATH, a cache and a working folder of its own."""
    for name in ("bin", "cache", "work"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "bin"


def install(folder: Path, name: str, code: int = 0) -> Path:
    """A program that writes down its arguments, complains and exits with `code`; returns where it writes."""
    log = folder / f"{name}.log"
    (folder / name).write_text(f'#!/bin/sh\necho "$*" >> {log}\necho "{name} complains" >&2\nexit {code}\n')
    (folder / name).chmod(0o755)
    return log


@pytest.mark.parametrize(("board", "hint"), [("meg", "did you mean 'mega'"), ("esp32", "mega, pico, tiva")])
def test_an_unknown_board_is_refused_with_the_known_ones(board: str, hint: str, tools: Path) -> None:
    with pytest.raises(UserError, match=hint):
        run_flash(board, "chefbot", "auto")


def test_a_bad_robot_is_reported_before_the_compiler(tools: Path) -> None:
    with pytest.raises(RobotFileError, match="no robot is called 'nobody'"):
        run_flash("mega", "nobody", "auto")


@pytest.mark.parametrize("board", TARGETS)
def test_missing_programs_are_named_with_their_packages(board: str, tools: Path) -> None:
    target = TARGETS[board]
    with pytest.raises(UserError, match=r"make is not installed: sudo apt-get install make"):
        run_flash(board, "chefbot", "auto")
    install(tools, "make")
    with pytest.raises(UserError) as error:
        run_flash(board, "chefbot", "auto")
    assert f"{target.compiler} is not installed: sudo apt-get install {target.compiler_packages}" in str(
        error.value
    )
    install(tools, target.compiler)
    with pytest.raises(UserError) as error:
        run_flash(board, "chefbot", "auto")
    assert str(error.value).startswith(f"{target.tool} is not installed: {target.tool_packages}")
    assert str(error.value).endswith(f"/chefbot/firmware/{target.program}"), "it can be flashed by hand"


def test_the_program_goes_to_the_port_that_was_given(tools: Path) -> None:
    install(tools, "make")
    install(tools, "avr-g++")
    log = install(tools, "avrdude", code=7)
    assert run_flash("mega", "chefbot", "/dev/ttyX7") == 7
    arguments = log.read_text().split()
    assert arguments[arguments.index("-P") + 1] == "/dev/ttyX7"
    assert arguments[-1] == f"flash:w:{tools.parent}/cache/chefbot/firmware/mega.hex:i"


def test_a_program_that_does_not_compile_is_not_flashed(tools: Path) -> None:
    install(tools, "make", code=2)
    install(tools, "avr-g++")
    log = install(tools, "avrdude")
    with pytest.raises(UserError, match="the firmware does not compile: make complains"):
        run_flash("mega", "chefbot", "/dev/ttyX7")
    assert not log.exists()


def test_a_folder_with_the_robots_name_is_not_taken_for_it(tools: Path) -> None:
    """As beside a clone of the repository, which is called chefbot."""
    Path("chefbot").mkdir()
    log = install(tools, "make")
    install(tools, "arm-none-eabi-g++")
    install(tools, "lm4flash")
    assert run_flash("tiva", "chefbot", "auto") == 0
    assert "ROBOT=chefbot " in log.read_text()


def test_a_robot_file_is_given_to_make_by_its_full_path(tools: Path) -> None:
    Path("mine.yaml").write_text("like: chefbot\n")
    log = install(tools, "make")
    install(tools, "arm-none-eabi-g++")
    install(tools, "picotool")
    assert run_flash("pico", "mine.yaml", "auto") == 0
    arguments = log.read_text().split()
    assert f"ROBOT={Path.cwd()}/mine.yaml" in arguments
    assert arguments[arguments.index("-C") + 1] == str(firmware_folder())


def test_the_only_likely_port_is_taken(tools: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from types import SimpleNamespace

    from serial.tools import list_ports

    def plug(*vendors: int) -> None:
        found = [
            SimpleNamespace(device=f"/dev/ttyX{i}", description="x", vid=vid, pid=1, serial_number=None)
            for i, vid in enumerate(vendors)
        ]
        monkeypatch.setattr(list_ports, "comports", lambda: found)

    for name in ("make", "avr-g++"):
        install(tools, name)
    log = install(tools, "avrdude")
    plug(0x9999, 0x2341)
    assert run_flash("mega", "chefbot", "auto") == 0
    assert "-P /dev/ttyX1 " in log.read_text()
    plug(0x2341, 0x1A86)
    with pytest.raises(UserError, match="give --port; boards may be at: /dev/ttyX0, /dev/ttyX1"):
        run_flash("mega", "chefbot", "auto")
    plug(0x9999)
    with pytest.raises(UserError, match="boards may be at: no port"):
        run_flash("mega", "chefbot", "auto")


def test_the_sources_of_the_firmware_are_found() -> None:
    assert (firmware_folder() / "core").is_dir()
