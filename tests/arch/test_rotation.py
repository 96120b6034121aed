"""Tests that of each rotated test one case runs with a commit, and every case with some commit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.support.rotation import VARIABLE, chosen_case

SUITE = """
import pytest

@pytest.mark.rotated
@pytest.mark.parametrize("case", range(4))
def test_many(case): pass

@pytest.mark.parametrize("case", range(3))
def test_all(case): pass

@pytest.mark.rotated("drives")
def test_forwards(): pass

@pytest.mark.rotated("drives")
@pytest.mark.parametrize("case", range(2))
def test_backwards(case): pass

@pytest.mark.rotated
@pytest.mark.parametrize("times", [1, pytest.param(100, marks=pytest.mark.long)])
def test_often(times): pass
"""


def test_every_case_runs_with_some_commit() -> None:
    chosen = {chosen_case("tests/a.py::test_b", 5, f"{commit:040x}") for commit in range(100)}
    assert chosen == set(range(5))


@pytest.mark.slow
def test_one_case_of_a_rotated_test_or_group_runs(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(SUITE)
    repository = Path(__file__).parents[2]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.conftest", "-c", "pyproject.toml"]
    command += ["--rootdir", str(repository), str(tmp_path)]
    environment = {
        "PATH": "/usr/bin:/bin",
        "HOME": str(tmp_path),
        "PYTHONPATH": f"{repository}:{repository}/src",
    }
    for rotate, passed in (("1", "6 passed, 6 deselected"), ("0", "11 passed, 1 deselected")):
        done = subprocess.run(
            command, cwd=repository, env={**environment, VARIABLE: rotate}, capture_output=True, text=True
        )
        assert passed in done.stdout, done.stdout + done.stderr
