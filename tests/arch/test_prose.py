"""Docstrings begin with sentences, and kernels have comments."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from tests.arch.figures import (
    FEWEST_COMMENTS,
    comments_per_100_lines,
    fragments,
    is_fragment,
    kernel_files,
    public_docstrings,
)


@pytest.mark.slow
def test_public_docstrings_begin_with_a_sentence() -> None:
    assert fragments() == []


def test_kernels_explain_their_steps_in_comments() -> None:
    files = kernel_files()
    assert len(files) > 20
    assert comments_per_100_lines(files) >= FEWEST_COMMENTS


# -- the checks themselves: each must find what it is for


MODULE = '''
class Filter:
    """A filter."""

    def update(self):
        """Update it."""

    def _solve(self):
        """Solve."""

async def run():
    """Run it."""
'''


def test_fragments_of_classes_functions_and_methods_are_found() -> None:
    found = [place for place, text in public_docstrings(ast.parse(MODULE)) if is_fragment(text)]
    assert found == ["2 Filter", "11 run", "5 update"]


@pytest.mark.parametrize(
    ("docstring", "fragment"),
    [
        ("Update the filter.", True),
        ("Update the filter.\n\nscan: ranges (n,), m.", True),
        ("Update the filter with a scan.", False),
        ("Update the filter\nwith a scan.", False),
    ],
)
def test_words_of_the_first_paragraph_count(docstring: str, fragment: bool) -> None:
    assert is_fragment(docstring) == fragment


def test_comments_are_counted_without_docstrings_and_noqa(tmp_path: Path) -> None:
    path = tmp_path / "kernel.py"
    path.write_text(
        '"""Doc\nstring."""\n\n# gain\na = 1  # noqa: E501\nb = 2  # innovation\n\nc = 3\nd = 4\n'
    )
    assert comments_per_100_lines([path]) == pytest.approx(50.0)
