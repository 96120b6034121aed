"""What README.md and docs/*.md promise exists: commands, options, launches, files, pictures."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main
from tests.support.waiting import PATIENCE

from chefbot.cli.app import app
from chefbot.launcher.launch import parse_arguments
from chefbot.robot.geometry.layout import body_height
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.storage.places import load_places

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
YAML = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
SOURCE = re.compile(r"`((?:src|examples|docs|tests|bench)/[\w./-]+)`")


def commands(page: Path) -> list[list[str]]:
    """The tokens of each command in the page's `sh` blocks, without comments and without where its output goes."""
    lines = "".join(FENCE.findall(page.read_text())).replace("\\\n", " ").splitlines()
    return [tokens for line in lines if (tokens := before_redirection(shlex.split(line, comments=True)))]


def before_redirection(tokens: list[str]) -> list[str]:
    return tokens[: tokens.index(">")] if ">" in tokens else tokens


def all_commands() -> list[list[str]]:
    return [tokens for page in PAGES for tokens in commands(page)]


def without_environment(tokens: list[str]) -> list[str]:
    while tokens and re.match(r"^[A-Z_]+=", tokens[0]):
        tokens = tokens[1:]
    return tokens


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_chefbot_command_parses(page: Path) -> None:
    group = typer.main.get_command(app)
    for tokens in map(without_environment, commands(page)):
        if tokens[0] != "chefbot":
            continue
        context = group.make_context("chefbot", tokens[1:])
        if tokens[1].startswith("-"):
            continue
        name, verb, rest = group.resolve_command(context, tokens[1:])  # type: ignore[attr-defined]
        while hasattr(verb, "commands") and rest:
            context = verb.make_context(name, list(rest), parent=context)
            name, verb, rest = verb.resolve_command(context, list(rest))
        assert name and verb
        parsed = verb.make_context(name, list(rest))
        if name == "launch" and parsed.params["name"]:
            file = parsed.params["name"]
            path = str(ROOT / file) if "/" in file else file
            load_launch(path, parse_arguments(parsed.params["arguments"] or []))


def test_every_make_target_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    used = {tokens[1] for tokens in all_commands() if tokens[0] == "make"}
    assert {"demo", "test"} <= used <= targets


def test_every_python_script_exists() -> None:
    scripts = [
        tokens[1] for tokens in all_commands() if tokens[0] in ("python", "python3", ".venv/bin/python")
    ]
    scripts = [one for one in scripts if one.endswith(".py")]
    assert scripts and all((ROOT / one).is_file() for one in scripts)


def test_only_known_programs_are_used() -> None:
    programs = {without_environment(tokens)[0] for tokens in all_commands()}
    assert programs <= {
        "chefbot",
        "chromium",
        "make",
        "python",
        "python3",
        "pip",
        "git",
        "cd",
        "dask",
        "sudo",
        "source",
        ".venv/bin/python",
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_linked_file_and_picture_exists(page: Path) -> None:
    text = page.read_text()
    links = [one for one in LINK.findall(text) if "://" not in one]
    missing = [one for one in links if not (page.parent / one).exists()]
    missing += [one for one in SOURCE.findall(text) if not (ROOT / one).exists()]
    assert not missing


def test_every_picture_is_used_and_small() -> None:
    shown = {
        Path(one).name for page in PAGES for one in LINK.findall(page.read_text()) if one.endswith(".png")
    }
    pictures = list((ROOT / "docs" / "pictures").glob("*.png"))
    assert {one.name for one in pictures} == shown
    assert all(one.stat().st_size < 150_000 for one in pictures)


@pytest.mark.slow
def test_the_quick_commands_of_the_readme_run() -> None:
    quick = [["--version"], ["launch"], *([verb, "--help"] for verb in ("demo", "launch", "replay", "map"))]
    for tokens in quick:
        done = subprocess.run(
            [sys.executable, "-m", "chefbot", *tokens],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert done.returncode == 0 and done.stdout, (tokens, done.stderr)


@pytest.mark.slow
def test_the_one_line_commands_of_the_pages_run() -> None:
    lines = [tokens for tokens in all_commands() if tokens[:2] == ["python", "-c"]]
    assert lines
    for tokens in lines:
        done = subprocess.run(
            [sys.executable, *tokens[1:]], capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        assert done.returncode == 0 and done.stdout, (tokens, done.stderr)


def test_the_robot_excerpt_is_valid(tmp_path: Path) -> None:
    (excerpt,) = YAML.findall((ROOT / "README.md").read_text())
    (tmp_path / "my_robot.yaml").write_text(excerpt)
    mine, theirs = load_robot(str(tmp_path / "my_robot.yaml")), load_robot("chefbot")
    assert mine.name == "my_robot" and mine.wheels.diameter == pytest.approx(0.12)
    assert mine.wheels.width == theirs.wheels.width and body_height(mine) > body_height(theirs)


def test_the_places_excerpt_is_valid(tmp_path: Path) -> None:
    (excerpt,) = YAML.findall((ROOT / "docs" / "learn" / "09_delivery.md").read_text())
    (tmp_path / "map.places.yaml").write_text(excerpt)
    assert set(load_places(tmp_path / "map.places.yaml")) == {"kitchen", "table_3"}


def test_the_readme_gives_the_true_length_of_the_loop_example() -> None:
    length = len((ROOT / "examples" / "00_one_loop.py").read_text().splitlines())
    assert f"file of {length} lines" in (ROOT / "README.md").read_text()


@pytest.mark.slow
def test_pictures_are_written_to_the_given_folder(tmp_path: Path) -> None:
    """And not over the repository's own, whose exercise is to falsify them."""
    before = {path: path.stat().st_mtime_ns for path in (ROOT / "docs" / "pictures").iterdir()}
    script = (
        "import sys; sys.argv = ['make_pictures.py', sys.argv[1]]; import picture_tools as tools;"
        " tools.write(tools.canvas(1, 1, 1)[0], 'odometry'); assert tools.RUNS == tools.PICTURES"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "a" / "b")],
        cwd=ROOT / "docs", capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert f"{tmp_path}/a/b/odometry.png" in done.stdout
    assert (tmp_path / "a" / "b" / "odometry.png").is_file()
    assert {path: path.stat().st_mtime_ns for path in (ROOT / "docs" / "pictures").iterdir()} == before
