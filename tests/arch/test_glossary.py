"""One word for one thing: the words of docs/glossary.md in names and texts, and each class name for one class."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.arch.dialect import WORDS
from tests.arch.figures import (
    FILES,
    REPOSITORY,
    SOURCE,
    class_names,
    dialect_in,
    dialect_in_test_names,
    duplicate_classes,
    phrases_in,
)

PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "firmware/*.md", ".github/**/*.md")
    for path in REPOSITORY.glob(pattern)
    if not {"_build", "generated"} & set(path.relative_to(REPOSITORY).parts)
)
SCREENS = sorted(
    path
    for path in (SOURCE / "ui" / "static").rglob("*")
    if path.suffix in (".js", ".html") and "vendor" not in path.parts
)
"""Files of the web UI with texts that an operator reads."""
LAUNCHES = sorted(SOURCE.rglob("*.yaml"))
TESTS = sorted(
    path
    for folder in ("tests", "bench", "examples")
    for path in (REPOSITORY / folder).rglob("*.py")
    if path.parent.name != "arch"  # the list itself, and its test
)
_CODE = re.compile(r"^```.*?^```|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def prose_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of a page with code blocks and inline code blanked out."""
    text = _CODE.sub(lambda match: "\n" * match[0].count("\n"), path.read_text())
    yield from enumerate(text.splitlines(), 1)


def findings(path: Path, lines: Iterator[tuple[int, str]]) -> list[str]:
    name = path.relative_to(REPOSITORY)
    return [f"{name}:{number} {phrase!r}" for number, line in lines for phrase in phrases_in(line)]


def relative(path: Path) -> str:
    return str(path.relative_to(REPOSITORY))


@pytest.mark.slow
@pytest.mark.parametrize("paths", [FILES, TESTS], ids=["source", "tests_and_benches"])
def test_code_uses_the_words_of_the_glossary(paths: list[Path]) -> None:
    found = {relative(path): dict(words) for path in paths if (words := dialect_in(path))}
    assert found == {}


def test_pages_use_the_words_of_the_glossary() -> None:
    assert [place for path in PAGES for place in findings(path, prose_lines(path))] == []


def test_screens_and_launches_use_the_words_of_the_glossary() -> None:
    files = [(path, path.read_text().splitlines()) for path in SCREENS + LAUNCHES]
    assert [place for path, lines in files for place in findings(path, iter(enumerate(lines, 1)))] == []


@pytest.mark.slow
def test_names_of_tests_use_the_words_of_the_glossary() -> None:
    assert dialect_in_test_names() == []


@pytest.mark.slow
def test_no_class_name_is_defined_twice() -> None:
    assert duplicate_classes(class_names()) == {}


def test_every_kind_of_file_is_checked() -> None:
    assert len(FILES) > 300 and len(PAGES) > 30 and len(SCREENS) > 5 and len(LAUNCHES) > 20
    assert len(TESTS) > 400


# -- the checks themselves: each must find what it is for


def write_module(folder: Path, text: str) -> Path:
    path = folder / "module.py"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "def tell_robot(): ...",
        "class HeardMessage: ...",
        "def f(last_words): ...",
        "lambda wish: wish",
        "for sane in (): ...",
        "import os as sane",
        '"""The node tells it."""',
        'raise ValueError("nobody told it")',
        'f"{name} says {text}"',
        'option(help="anew")',
    ],
)
def test_a_word_of_the_list_is_found(tmp_path: Path, text: str) -> None:
    assert dialect_in(write_module(tmp_path, text))


@pytest.mark.parametrize(
    "text",
    [
        "saying_goodbye = 1",
        "swordsman = 2",
        "least_squares = 3",
        '"""The trim of a sensor."""',
        '"""Recursive least squares of the log."""',
        "class Telltale: ...",
    ],
)
def test_parts_of_other_words_are_not_found(tmp_path: Path, text: str) -> None:
    assert not dialect_in(write_module(tmp_path, text))


@pytest.mark.parametrize("phrase", WORDS.prose)
def test_a_phrase_is_found_in_a_sentence_in_either_case(phrase: str) -> None:
    assert phrase in phrases_in(f"The robot, {phrase.capitalize()}, drives.")


def test_code_on_a_page_is_left_out_and_lines_are_counted(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("```sh\nsay anew\n```\n`anew`\nBuilt anew.\n")
    assert [(number, phrases_in(line)) for number, line in prose_lines(page) if phrases_in(line)] == [
        (5, ["anew"])
    ]


def test_messages_of_different_ros_packages_may_share_a_name() -> None:
    assert duplicate_classes({"Empty": ["msgs/std_msgs.py", "msgs/std_srvs.py"]}) == {}
    for places in (
        ["msgs/std_msgs.py", "msgs/std_msgs.py"],
        ["msgs/std_msgs.py", "slam/params.py"],
        ["msgs/idl/fields.py", "msgs/std_msgs.py"],
        ["sim/a.py", "ui/b.py"],
    ):
        assert duplicate_classes({"Empty": places}) == {"Empty": places}
