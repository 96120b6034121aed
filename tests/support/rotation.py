"""Tests of long cases of which each run of the suite makes one, chosen by the commit.

`@pytest.mark.rotated` on a parametrized test: `make test` runs one of its cases, another with each commit, and names
it in the header; `make test-long`, and pytest by itself, run all. Tests marked `rotated("a group")` are the cases of
that group, in whichever files they stand.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
from collections import defaultdict
from pathlib import Path

import pytest

VARIABLE = "CHEFBOT_ROTATE"


def is_rotating() -> bool:
    """Whether this run makes one case of each rotated test only."""
    return os.environ.get(VARIABLE) == "1"


def commit_of(repository: Path) -> str:
    """Return the commit of a working tree, or an empty string outside of git."""
    command = ["git", "-C", str(repository), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def chosen_case(test: str, count: int, commit: str) -> int:
    """Return which of the cases 0..count-1 of a test runs with a commit."""
    return int.from_bytes(hashlib.sha256(f"{commit} {test}".encode()).digest()[:8], "big") % count


def group_of(item: pytest.Item, marker: pytest.Mark) -> str:
    """Return the name of the cases to which a rotated test belongs."""
    return str(marker.args[0]) if marker.args else item.nodeid.partition("[")[0]


def is_rotated(item: pytest.Item) -> bool:
    """Whether a test is one case of several; those that `make test` leaves out anyway are not."""
    return bool(item.get_closest_marker("rotated")) and not item.get_closest_marker("long")


def split(items: list[pytest.Item], commit: str) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests that run with a commit, in their order, and those that do not."""
    cases: dict[str, list[pytest.Item]] = defaultdict(list)
    for item in items:
        marker = item.get_closest_marker("rotated")
        if marker and is_rotated(item):
            cases[group_of(item, marker)].append(item)
    kept = {id(group[chosen_case(test, len(group), commit)]) for test, group in cases.items()}
    runs = [item for item in items if not is_rotated(item) or id(item) in kept]
    return runs, [item for item in items if is_rotated(item) and id(item) not in kept]
