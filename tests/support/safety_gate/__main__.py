"""`make safety-gate` and `make safety-mutants`.

`python -m tests.support.safety_gate coverage [MODULE ...]` fails if a line or branch is not reached;
`… mutants [MODULE ...]` fails if more than one mutant in twenty survives, and writes the page of all modules.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from tests.support.safety_gate.judge import Verdict, judged
from tests.support.safety_gate.measure import ModuleCoverage, measured
from tests.support.safety_gate.modules import MEASURED_TOGETHER, MODULES, without_compiler
from tests.support.safety_gate.table import counted, share_killed, survivors, table, write_page

WANTED = 0.95
"""Share of the mutants that the tests have to kill, of each module."""


def in_new_process(step: str, modules: Sequence[str], jobs: int = 1) -> list[list[object]]:
    """Run a step for some modules in a process that has imported nothing yet, and return its result."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "result.json")
        command = [sys.executable, "-m", "tests.support.safety_gate", step, *modules, "--out", str(out)]
        environment = {**os.environ, **without_compiler(modules), "HYPOTHESIS_PROFILE": "thorough"}
        done = subprocess.run(
            [*command, "--jobs", str(jobs)], env=environment, check=False, stdout=subprocess.PIPE, text=True
        )
        if done.returncode:
            raise SystemExit(f"{done.stdout}\n{step} of {', '.join(modules)} has failed")
        return list(json.loads(out.read_text()))


def coverage_of(modules: Sequence[str]) -> list[ModuleCoverage]:
    """Return the coverage of some modules, in their order."""
    found: dict[str, ModuleCoverage] = {}
    for together in MEASURED_TOGETHER:
        part = [module for module in modules if module in together]
        if part:
            found |= {
                one.module: one for one in (ModuleCoverage(*row) for row in in_new_process("measure", part))
            }  # type: ignore[arg-type]
    return [found[module] for module in modules]


def verdicts_of(module: str, jobs: int) -> list[Verdict]:
    """Return the verdicts on the mutants of a module that count."""
    return counted([Verdict(*row) for row in in_new_process("judge", [module], jobs)])  # type: ignore[arg-type]


def check_coverage(modules: Sequence[str]) -> int:
    """Print the coverage of some modules, and return 1 if something is missing."""
    found = coverage_of(modules)
    for one in found:
        state = f"missing {one.missing}" if one.missing else "100 %"
        sys.stdout.write(f"{one.module}: {one.lines} lines, {one.branches} branches, {state}\n")
    return int(any(one.missing for one in found))


def check_mutants(modules: Sequence[str], jobs: int) -> int:
    """Print the mutants of some modules that survive, and return 1 if there are too many of one."""
    verdicts = {}
    for module in modules:
        verdicts[module] = found = verdicts_of(module, jobs)
        sys.stdout.write(f"{module}: {share_killed(found):.1%} of {len(found)} killed\n{survivors(found)}")
        sys.stdout.flush()
    if len(modules) == len(MODULES):
        coverage = coverage_of(modules)
        write_page(coverage, verdicts)
        sys.stdout.write(table(coverage, verdicts) + "\n")
    return int(any(share_killed(found) < WANTED for found in verdicts.values()))


def main() -> int:
    """Run a gate, or a step of one in this process, and return 0 if it is passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("step", choices=["coverage", "mutants", "measure", "judge"])
    parser.add_argument("modules", nargs="*", help="their names, by default all")
    parser.add_argument("--jobs", type=int, default=2, help="mutants that are judged at once")
    parser.add_argument("--out", type=Path, help="file of the result, for the steps measure and judge")
    args = parser.parse_args()
    if unknown := set(args.modules) - set(MODULES):
        parser.error(f"not of safety: {', '.join(sorted(unknown))}; known are {', '.join(MODULES)}")
    modules = [module for module in MODULES if not args.modules or module in args.modules]
    if args.step == "coverage":
        return check_coverage(modules)
    if args.step == "mutants":
        return check_mutants(modules, args.jobs)
    result = measured(modules) if args.step == "measure" else judged(modules[0], args.jobs)
    args.out.write_text(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
