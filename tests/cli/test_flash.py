"""`chefbot board flash` and `image`, with stand-ins of the flashing tools on the PATH."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from serial.tools import list_ports

from chefbot.board.firmware_image import intel_hex, uf2, with_robot
from chefbot.cli.board.flash import TOOLS, run_flash
from chefbot.cli.board.image import FORMATS, IMAGES, run_image
from chefbot.errors import UserError
from chefbot.robot.errors import RobotFileError
from chefbot.robot.load import load_robot


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
        run_flash(board, "chefbot", "auto", None)


def test_a_bad_robot_is_reported_before_the_tool(tools: Path) -> None:
    with pytest.raises(RobotFileError, match="no robot is called 'nobody'"):
        run_flash("mega", "nobody", "auto", None)


def test_a_drive_with_its_own_firmware_is_refused(tools: Path) -> None:
    Path("claw.yaml").write_text("like: chefbot\nname: claw\ndrive: {protocol: roboclaw}\n")
    with pytest.raises(UserError, match="claw has no motor board: its drive, roboclaw, has its own firmware"):
        run_flash("mega", "claw.yaml", "auto", None)


@pytest.mark.parametrize("board", FORMATS)
def test_no_compiler_is_needed_and_a_missing_tool_is_named(board: str, tools: Path) -> None:
    tool = TOOLS[board]
    with pytest.raises(UserError) as error:
        run_flash(board, "chefbot", "auto", None)
    assert str(error.value).startswith(f"{tool.name} is not installed: {tool.installation}")
    path = tools.parent / "cache" / "chefbot" / "firmware" / f"chefbot_{board}{FORMATS[board].suffix}"
    assert str(error.value).endswith(f"the firmware is {path}"), "it can be flashed by hand"
    assert path.stat().st_size > 5000


def test_the_firmware_goes_to_the_port_that_was_given(tools: Path) -> None:
    log = install(tools, "avrdude", code=7)
    assert run_flash("mega", "desk", "/dev/ttyX7", None) == 7
    arguments = log.read_text().split()
    assert arguments[arguments.index("-P") + 1] == "/dev/ttyX7"
    path = tools.parent / "cache" / "chefbot" / "firmware" / "desk_mega.hex"
    assert arguments[-1] == f"flash:w:{path}:i"
    program = (IMAGES / "mega.bin").read_bytes()
    assert path.read_bytes() == intel_hex(with_robot(program, load_robot("desk"), "mega"))


def test_the_robot_of_a_file_is_filled_in(tools: Path) -> None:
    Path("mine.yaml").write_text("like: chefbot\nname: mine\nboard: {kind: pico, pins: {estop: 22}}\n")
    log = install(tools, "picotool")
    assert run_flash("", "mine.yaml", "auto", None) == 0
    path = Path(log.read_text().split()[-1])
    program = (IMAGES / "pico.bin").read_bytes()
    assert path.read_bytes() == uf2(with_robot(program, load_robot("mine.yaml"), "pico"))


def test_a_program_of_ones_own_is_flashed(tools: Path) -> None:
    own = (IMAGES / "tiva.bin").read_bytes() + b"more"
    Path("own.bin").write_bytes(own)
    log = install(tools, "lm4flash")
    assert run_flash("tiva", "chefbot", "auto", Path("own.bin")) == 0
    path = Path(log.read_text().split()[-1])
    assert path.read_bytes() == with_robot(own, load_robot("chefbot"), "tiva")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"\x7fELF", "own.bin cannot be used: it is not chefbot's firmware for the tiva"),
        (None, "own.bin cannot be read: No such file"),
    ],
)
def test_a_bad_program_is_not_flashed(content: bytes | None, reason: str, tools: Path) -> None:
    if content is not None:
        Path("own.bin").write_bytes(content)
    log = install(tools, "lm4flash")
    with pytest.raises(UserError, match=reason):
        run_flash("tiva", "chefbot", "auto", Path("own.bin"))
    assert not log.exists()


def test_the_only_likely_port_is_taken(tools: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def plug(*vendors: int) -> None:
        found = [
            SimpleNamespace(device=f"/dev/ttyX{i}", description="x", vid=vid, pid=1, serial_number=None)
            for i, vid in enumerate(vendors)
        ]
        monkeypatch.setattr(list_ports, "comports", lambda: found)

    log = install(tools, "avrdude")
    plug(0x9999, 0x2341)
    assert run_flash("mega", "chefbot", "auto", None) == 0
    assert "-P /dev/ttyX1 " in log.read_text()
    plug(0x2341, 0x1A86)
    with pytest.raises(UserError, match="give --port; boards may be at: /dev/ttyX0, /dev/ttyX1"):
        run_flash("mega", "chefbot", "auto", None)
    plug(0x9999)
    with pytest.raises(UserError, match="boards may be at: no port"):
        run_flash("mega", "chefbot", "auto", None)


def test_the_image_is_written_with_its_constants(tools: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_image("pico", "chefbot", None, None)
    out = capsys.readouterr().out
    assert "runs/chefbot_pico.uf2: firmware for the pico, driver inputs ina_inb_pwm" in out
    assert "battery_stop" in out and "11200" in out
    program = (IMAGES / "pico.bin").read_bytes()
    assert Path("runs/chefbot_pico.uf2").read_bytes() == uf2(
        with_robot(program, load_robot("chefbot"), "pico")
    )


def test_a_file_of_another_format_is_refused(tools: Path) -> None:
    with pytest.raises(UserError, match=r"--out x\.bin: the tools of the mega take a file \.hex"):
        run_image("mega", "chefbot", None, Path("x.bin"))
    assert not Path("x.bin").exists()
