"""docs/architecture.md names files and functions that exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text()
STEPS = re.findall(r"\| `((?:src|firmware)/[\w./-]+)` \| `?([\w.]*)`? ?\|$", PAGE, re.MULTILINE)
FOLDERS = re.findall(r"`((?:src|tests|docs)/[\w./-]+)`", PAGE)


def definitions(path: Path) -> set[str]:
    """Names of all functions and classes of a file, those of a class with its name and a dot before."""
    found: set[str] = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ClassDef):
            inner = [one for one in node.body if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)]
            found |= {node.name, *(f"{node.name}.{one.name}" for one in inner)}
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            found.add(node.name)
    return found


def test_the_walks_are_found() -> None:
    assert len(STEPS) >= 35


@pytest.mark.parametrize(("file", "function"), STEPS, ids=[f"{file}:{name}" for file, name in STEPS])
def test_each_step_names_an_existing_file_and_function(file: str, function: str) -> None:
    assert (ROOT / file).is_file()
    if file.endswith(".py"):
        assert function in definitions(ROOT / file)


def test_all_named_files_and_folders_exist() -> None:
    assert [one for one in FOLDERS if not (ROOT / one).exists()] == []
