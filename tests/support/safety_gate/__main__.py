"""`make safety-gate` and `make safety-mutants`: `python -m tests.support.safety_gate coverage|mutants [module ...]`."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path

from tests.support.safety_gate.modules import MODULES, REPOSITORY

WANTED = 0.95
"""Share of the mutants that the tests have to kill, of all modules and of each."""


def main() -> int:
    """Run a gate and return 0 if it is passed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("gate", choices=["coverage", "mutants", "judge"])
    parser.add_argument("modules", nargs="*", help="last parts of names, by default all")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=None)
    args = parser.parse_args()
    modules = [name for name in MODULES if not args.modules or set(args.modules) & {name, name.split(".")[-1]}]
    print(modules)
    if args.gate == "coverage":
        from tests.support.safety_gate.measure import measured
        for one in measured(modules):
            print(one)
    else:
        from tests.support.safety_gate.judge import judged
        for name in modules:
            v = judged(name, args.jobs)
            print(name, len(v), sum(x.killed for x in v))
            for x in v:
                if not x.killed:
                    print("  ", x.line, x.function, x.change)
    return 0


if __name__ == "__main__":
    sys.exit(main())
