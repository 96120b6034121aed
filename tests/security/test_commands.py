"""Commands given anything but the file that they want: a sentence and exit code 2, no traceback, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chefbot.cli.app import app
from chefbot.cli.error_handling import printable
from chefbot.errors import ChefbotError

LONG = "n" * 300
COMMANDS = {
    "robot check": ["robot", "check", "{file}.yaml"],
    "robot urdf": ["robot", "export", "urdf", "{file}.yaml"],
    "check-urdf": ["robot", "check-urdf", "{file}.urdf"],
    "check-urdf of xacro": ["robot", "check-urdf", "{file}.xacro"],
    "world draw": ["world", "draw", "{file}.yaml", "--out", "{out}/x.png"],
    "map slam": ["map", "slam", "{file}.log", "--out", "{out}"],
    "replay": ["replay", "{file}.mcap"],
    "bag info": ["bag", "info", "{file}.mcap"],
    "launch": ["launch", "{file}.yaml"],
    "prove": ["prove", "{file}.yaml", "--out", "{out}"],
    "fleet accept": ["fleet", "accept", "{file}.card", "--folder", "{out}/keys"],
    "fleet sign": ["fleet", "sign", "{file}.request", "--folder", "{out}/keys"],
}
CONTENTS = {
    "empty": b"",
    "zeros": bytes(1000),
    "utf-16": "name: x\n".encode("utf-16"),
    "byte order mark": b"\xef\xbb\xbf\xef\xbb\xbf",
    "carriage returns": b"a: 1\rb: [\r",
    "not text": bytes(range(256)),
}
OBSTACLES = ("folder", "pipe", "device", "circular link", "missing")


def prepare(path: Path, kind: str) -> None:
    """Put a content or an obstacle at the path."""
    if kind in CONTENTS:
        path.write_bytes(CONTENTS[kind])
    elif kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind != "missing":
        path.symlink_to("/dev/zero" if kind == "device" else path.name)


def refused(arguments: list[str], tmp_path: Path) -> str:
    """Run a command that must be refused; return its sentence."""
    before = sorted(tmp_path.rglob("*"))
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, ChefbotError), (result.exception, result.output)
    assert "\n" not in str(result.exception)
    left = [path for path in tmp_path.rglob("*") if path not in before and not path.is_dir()]
    assert not left, f"half written: {left}"
    return str(result.exception)


@pytest.mark.parametrize("kind", [*CONTENTS, *OBSTACLES])
@pytest.mark.parametrize("command", COMMANDS)
def test_another_kind_of_file_is_reported_in_one_sentence(command: str, kind: str, tmp_path: Path) -> None:
    if (command, kind) == ("bag info", "folder"):
        pytest.skip("a bag may be a folder")
    arguments = [
        argument.format(file=tmp_path / "given", out=tmp_path / "out") for argument in COMMANDS[command]
    ]
    given = next(Path(argument) for argument in arguments if Path(argument).name.startswith("given"))
    prepare(given, kind)
    refused(arguments, tmp_path)


NAMES = {
    "long": LONG,
    "long folder": f"{LONG}/x",
    "surrogate": "a\udcffb",
    "control": "a\x1b[2Jb\nc",
}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", COMMANDS)
def test_a_name_that_no_file_has_is_refused(command: str, name: str, tmp_path: Path) -> None:
    file = tmp_path / NAMES[name]
    arguments = [argument.format(file=file, out=tmp_path / "out") for argument in COMMANDS[command]]
    result = CliRunner().invoke(app, arguments)
    assert isinstance(result.exception, ChefbotError), (result.exception, result.output)


def test_control_characters_of_names_do_not_reach_the_terminal(tmp_path: Path) -> None:
    start = "import sys; from chefbot.cli.app import main; sys.argv[0] = 'chefbot'; main()"
    name = os.fsencode(tmp_path / "a\x1b[2J\udcff.mcap")
    done = subprocess.run(
        [sys.executable, "-c", start, "bag", "info", name], capture_output=True, timeout=120
    )
    assert done.returncode == 2 and b"\x1b" not in done.stderr and rb"\x1b[2J\udcff" in done.stderr
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize("name", ["a" * 300, "a\\0b", "../" * 2000 + "x", "/dev/zero", "loop.pgm"])
def test_names_within_files_may_be_anything(name: str, tmp_path: Path) -> None:
    (tmp_path / "loop.pgm").symlink_to("loop.pgm")
    (tmp_path / "loop.yaml").symlink_to("loop.yaml")
    numbers = "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n"
    (tmp_path / "map.yaml").write_text(f'image: "{name}"\n{numbers}')
    refused(["world", "draw", str(tmp_path / "map.yaml"), "--out", str(tmp_path / "out.png")], tmp_path)
    (tmp_path / "r.yaml").write_text(f'name: r\nlike: "{name.replace("pgm", "yaml")}/x.yaml"\n')
    refused(["robot", "check", str(tmp_path / "r.yaml")], tmp_path)
    (tmp_path / "l.yaml").write_text(f'include: ["{name.replace("pgm", "yaml")}/x.yaml"]\n')
    refused(["launch", str(tmp_path / "l.yaml")], tmp_path)
    mesh = name.replace("\\0", "&#1;")
    (tmp_path / "r.urdf").write_text(
        '<robot name="r"><link name="a"><visual><geometry>'
        f'<mesh filename="{mesh}"/></geometry></visual></link></robot>'
    )
    if name != "/dev/zero":
        refused(["robot", "check-urdf", str(tmp_path / "r.urdf")], tmp_path)


def test_escapes_are_those_of_python() -> None:
    assert printable("a\x1b[2J\x07 é ü \u202e\udcff") == "a\\x1b[2J\\x07 é ü \\u202e\\udcff"
