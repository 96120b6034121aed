"""Line and branch coverage of the modules of safety, each by its own tests."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from coverage import Coverage

from tests.support.safety_gate.modules import MODULES, path_of, without_compiler

OPTIONS = ["-q", "-p", "no:cacheprovider", "--no-header", "--no-summary"]
OPTIONS += [
    "-W",
    "ignore::pytest.PytestAssertRewriteWarning",
]  # what all need is imported before pytest begins


class ModuleCoverage(NamedTuple):
    """What the tests of a module run of it. missing: "12, 30 -> 33": lines, and branches from line to line."""

    module: str
    lines: int
    branches: int
    missing: str


class ContextPerTest:
    """Plugin of pytest that notes for each test which lines it runs."""

    def __init__(self, coverage: Coverage) -> None:
        self.coverage = coverage
        self.measures = True

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Measure a test in a context with its name."""
        if self.measures:
            self.coverage.switch_context(item.nodeid)
        done = yield
        if self.measures:
            self.coverage.switch_context("")
        return done

    def stop(self) -> None:
        """End the measurement; tests may run on."""
        self.measures = False
        self.coverage.stop()


def new_coverage(modules: Collection[str]) -> Coverage:
    """Return the measurement of some modules, not started; to be made before they are imported."""
    os.environ.update(without_compiler(modules))
    return Coverage(
        data_file=None, branch=True, config_file=False, include=[str(path_of(module)) for module in modules]
    )


def measured(modules: Collection[str]) -> list[ModuleCoverage]:
    """Run the tests of some modules here and return the coverage of each by its own; SystemExit if one fails."""
    coverage = new_coverage(modules)
    coverage.start()
    files = dict.fromkeys(file for module in modules for file in MODULES[module])
    contexts = ContextPerTest(coverage)
    code = pytest.main([*OPTIONS, *files], plugins=[contexts])
    contexts.stop()
    if code:
        raise SystemExit(f"The tests of safety fail without Numba: pytest returned {code!r}.")
    return [_coverage_of(coverage, module) for module in modules]


def _coverage_of(coverage: Coverage, module: str) -> ModuleCoverage:
    """Return the coverage of a module by its own tests, and by being imported."""
    contexts = ["^$", *(f"^{re.escape(file)}::" for file in MODULES[module])]
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder, "coverage.json")
        coverage.json_report([str(path_of(module))], outfile=str(report), contexts=contexts)
        (found,) = json.loads(report.read_text())["files"].values()
    lines = [str(line) for line in found["missing_lines"]]
    branches = [f"{start} -> {end if end > 0 else 'exit'}" for start, end in found["missing_branches"]]
    summary = found["summary"]
    missing = ", ".join(lines + branches)
    return ModuleCoverage(module, summary["num_statements"], summary["num_branches"], missing)
