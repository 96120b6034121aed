"""Mutants of the files of strangers by seed: how many end in a traceback, a signal, a hang, or too much memory.

Run: python bench/bench_mutants.py [--number N] [--seed S] [KIND ...]; without kinds all of them. With `--again NAME`,
as in `--again "card 7 1234"`, one mutant is read in this process, with its traceback.

Every mutant is read in a child process with 400 MB of memory and 2 s of CPU time. The exit code is 1 if any of them
does something other than being read or refused in one sentence.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from tests.support.mutants.samples import samples  # noqa: E402
from tests.support.mutants.trial import again, run, table  # noqa: E402


def main() -> None:
    """Run the mutants that the command line asks for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", help=f"of {', '.join(samples())}")
    parser.add_argument("--number", type=int, default=500, help="mutants of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--again", default="", help="name of one mutant, as a fault names it")
    given = parser.parse_args()
    if given.again:
        print(again(given.again, Path(tempfile.mkdtemp(prefix="mutant_"))))
        return
    reports = {}
    for kind in given.kinds or samples():
        begun = time.monotonic()
        reports[kind] = run(kind, given.seed, given.number)
        counts = ", ".join(f"{count} {name}" for name, count in sorted(reports[kind].counts.items()))
        print(f"{kind}: {counts}; {time.monotonic() - begun:.0f} s", flush=True)
    print("\n" + table(reports))
    sys.exit(1 if any(report.faults for report in reports.values()) else 0)


if __name__ == "__main__":
    main()
