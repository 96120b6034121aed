"""Tests that the files of nodes are short: they contain ports and parameters, the algorithms are elsewhere."""

from __future__ import annotations

from pathlib import Path

import pytest

import chefbot.nodes

MAX_LINES = 150
FOLDER = Path(chefbot.nodes.__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(FOLDER)))
def test_a_node_file_is_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_LINES
