"""Syntax trees of the files that the rules look at; several rules look at each file."""

from __future__ import annotations

import ast
import functools
from pathlib import Path


def parse(path: Path) -> ast.Module:
    """Return the syntax tree of a file, shared with other rules: it must not be changed."""
    return parse_text(path.read_text())


def walk(path: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the syntax tree of a file."""
    return walk_text(path.read_text())


@functools.cache
def walk_text(text: str) -> tuple[ast.AST, ...]:
    """Return all nodes of the syntax tree of a text."""
    return tuple(ast.walk(parse_text(text)))


@functools.cache
def parse_text(text: str) -> ast.Module:
    """Return the syntax tree of a text, shared with other rules: it must not be changed."""
    return ast.parse(text)
