"""Line and branch coverage of the safety part from gcov: prints a table, fails below 100 %.

Usage: coverage.py FOLDER NAME...   (FOLDER holds NAME.gcno and NAME.gcda)
"""

# ruff: noqa: T201
from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple


class Counted(NamedTuple):
    """Of one source file."""

    lines: dict[int, int]
    branches: dict[tuple[int, int], int]


def gcov(folder: Path, name: str) -> dict[str, Counted]:
    """Counts per source file that NAME's object knows; template and inline copies are added up."""
    command = ["gcov", "--json-format", "--branch-probabilities", "--stdout", f"{name}.gcda"]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True)
    report = json.loads(done.stdout)
    files: dict[str, Counted] = {}
    for file in report["files"]:
        if not file["file"].startswith("core/"):
            continue
        counted = files.setdefault(file["file"], Counted({}, {}))
        for line in file["lines"]:
            number = line["line_number"]
            counted.lines[number] = counted.lines.get(number, 0) + line["count"]
            for i, branch in enumerate(line["branches"]):
                counted.branches[number, i] = counted.branches.get((number, i), 0) + branch["count"]
    return files


def add_up(folder: Path, names: list[str]) -> dict[str, Counted]:
    """All objects; a header is in many of them."""
    total: dict[str, Counted] = {}
    for name in names:
        for file, counted in gcov(folder, name).items():
            into = total.setdefault(file, Counted({}, {}))
            for number, count in counted.lines.items():
                into.lines[number] = into.lines.get(number, 0) + count
            if file.endswith(".cpp"):
                into.branches.update(counted.branches)
    return total


def main() -> int:
    total = add_up(Path(sys.argv[1]), sys.argv[2:])
    gaps = 0
    print(f"{'safety part':24} {'lines':>9} {'branches':>9}")
    for file, (lines, branches) in sorted(total.items()):
        print(f"{file:24} {_share(lines.values()):>9} {_share(branches.values()):>9}")
        for place in [f"line {n}" for n, c in lines.items() if not c] + [
            f"branch {i} of line {n}" for (n, i), c in branches.items() if not c
        ]:
            print(f"    never run: {place}")
            gaps += 1
    every_line = [c for counted in total.values() for c in counted.lines.values()]
    every_branch = [c for counted in total.values() for c in counted.branches.values()]
    print(
        f"coverage of the safety part: {_percent(every_line)} of lines, {_percent(every_branch)} of branches"
    )
    return 1 if gaps else 0


def _share(counts: Collection[int]) -> str:
    return f"{sum(1 for c in counts if c)}/{len(counts)}"


def _percent(counts: list[int]) -> str:
    return f"{100.0 * sum(1 for c in counts if c) / len(counts):.1f} %"


if __name__ == "__main__":
    sys.exit(main())
