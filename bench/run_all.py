"""Runs all benchmarks in sequence, for `make bench`.

Run: python bench/run_all.py [NAME ...], such as `loop stack`; without names all of them.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent


def chosen(names: list[str]) -> list[Path]:
    """Return the scripts of these names, or all without names."""
    known = {path.stem.removeprefix("bench_"): path for path in sorted(HERE.glob("bench_*.py"))}
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"no benchmark is called {unknown[0]}; there are {', '.join(known)}")
    return [known[name] for name in names or known]


def run(script: Path) -> bool:
    """Run a benchmark in this terminal; return whether it succeeded."""
    print(f"\n=== {script.stem.removeprefix('bench_')} " + "=" * 60, flush=True)
    begun = time.monotonic()
    source = os.pathsep.join(filter(None, [str(HERE.parent / "src"), os.environ.get("PYTHONPATH")]))
    code = subprocess.run([sys.executable, str(script)], env={**os.environ, "PYTHONPATH": source}).returncode
    print(f"--- {time.monotonic() - begun:.0f} s" + (f", failed with exit code {code}" if code else ""))
    return code == 0


def main() -> None:
    """Run the chosen benchmarks; exit code 1 if one fails."""
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, ",
        end="",
    )
    print(f"Python {platform.python_version()}")
    failed = [script.name for script in chosen(sys.argv[1:]) if not run(script)]
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
