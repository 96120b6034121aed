"""Tests that the files of nodes are short: they contain ports and parameters, the algorithms are elsewhere."""

from __future__ import annotations

from pathlib import Path

import pytest

import chefbot.nodes

MAX_LINES = 150
FILES = sorted(Path(chefbot.nodes.__file__).parent.glob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_node_file_is_short(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_LINES
