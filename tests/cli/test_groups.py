"""The groups of the command line: the text without arguments, the nearest names, completion, and a fast help."""

from __future__ import annotations

import subprocess
import sys

import pytest
import typer.main
from tests.support.waiting import PATIENCE

from chefbot.cli import completion
from chefbot.cli.app import PANELS, WELCOME, app, main
from chefbot.runtime.launch import built_in_launches, load_launch

HEAVY = (
    "numpy",
    "numba",
    "mujoco",
    "zenoh",
    "scipy",
    "matplotlib",
    "msgspec",
    "serial",
    "trimesh",
    "asyncio.events",
)


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["chefbot", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return int(str(end.value.code or 0))


def test_without_arguments_it_shows_three_ways_to_begin(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch) == 0
    out = capsys.readouterr().out
    assert out == WELCOME and len(out.splitlines()) < 10
    assert all(f"chefbot {verb}" in out for verb in ("demo", "robot", "launch", "--help"))


def test_the_help_has_few_entries_of_one_line_in_panels(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert run(monkeypatch, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    panels = [line for line in lines if line.startswith("╭─")]
    assert [line.split("─")[1].strip() for line in panels] == ["Options", *PANELS]
    group = typer.main.get_command(app)
    entries = lines[lines.index(panels[1]) :]
    assert sum(line.startswith("│") for line in entries) == len(group.commands) <= 20  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    "group", ["robot", "robot export", "world", "board", "drive", "map", "fleet", "topic", "bag"]
)
def test_a_group_without_a_command_shows_its_help(
    group: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, *group.split()) == 0
    assert f"Usage: chefbot {group}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("desgn", "`chefbot` has no command 'desgn' (did you mean `chefbot robot design`?)"),
        ("urdf", "did you mean `chefbot robot export urdf`?"),
        ("flash --board mega", "did you mean `chefbot board flash`?"),
        ("map_saver -f hotel", "did you mean `chefbot map save`?"),
        ("teleop", "did you mean `chefbot drive keyboard`?"),
        ("dds", "did you mean `chefbot topic bridge`?"),
        ("keys init", "did you mean `chefbot fleet`?"),
        ("topic ecko", "did you mean `chefbot topic echo`?"),
        ("board qqq", "`chefbot board --help` lists all commands"),
        ("robot check chefbot --jsn", "`chefbot robot check` has no option --jsn (did you mean '--json'?)"),
        ("drive goto 1.5 -0.3", "-0 is not an option; write `--` before negative numbers"),
        ("--versio", "has no option --versio (did you mean '--version'?)"),
        ("robot check", "missing argument"),
        ("demo --port many", "invalid value for '--port'"),
        ("robot export solids --format gif", "'stl', 'glb', 'obj', 'step'"),
        ("robot export urdf --out a.urdf --package b", "give one of them"),
        ("drive goto", "missing argument"),
    ],
)
def test_a_wrong_command_or_option_is_reported_in_one_sentence(
    line: str, sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, *line.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith("chefbot: ") and sentence in error and error.count("\n") == 1


def test_the_help_imports_nothing_heavy() -> None:
    script = (
        "import sys\nsys.argv = ['chefbot', '--help']\nfrom chefbot.cli.app import main\n"
        f"try:\n    main()\nexcept SystemExit:\n    sys.exit(str([name for name in {HEAVY} if name in sys.modules]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert "Usage" in done.stdout and done.stderr.strip() == "[]"


def test_completion_offers_what_there_is() -> None:
    public = {name for name in built_in_launches() if load_launch(name).description}
    assert {name for name, _ in completion.launches("")} == public
    assert [name for name, _ in completion.launches("amcl")] == ["amcl_demo"]
    assert completion.robots("chefbot_") == ["chefbot_cliff", "chefbot_lidar"]
    assert completion.worlds("ho") == ["hotel"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "offer"),
    [
        ("chefbot lau", "launch"),
        ("chefbot launch gmapp", "gmapping_demo"),
        ("chefbot launch amcl_demo map_f", "map_file:="),
        ("chefbot robot check por", "porter"),
        ("chefbot sim wor", "workshop"),
        ("chefbot robot export u", "urdf"),
    ],
)
def test_the_shell_completes(line: str, offer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {
        "_CHEFBOT_COMPLETE": "complete_bash",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split()) - 1),
    }.items():
        monkeypatch.setenv(name, value)
    done = subprocess.run(
        [sys.executable, "-m", "chefbot"], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert offer in done.stdout.split(), done.stderr
