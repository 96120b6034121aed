"""Run `chefbot demo` and print, as a JSON list, the kernels that it compiles after all groups have been compiled.

`python -m tests.kernels.late_compilation [OPTIONS]` is a process of its own, as earlier tests in a process may
have compiled a kernel that no group compiles.
"""

from __future__ import annotations

import json
import sys

from numba.core.dispatcher import Dispatcher

from chefbot.cli.app import main as chefbot
from chefbot.kernels.groups import GROUPS


def signatures() -> dict[str, int]:
    """Return for each kernel the number of signatures for which it has been compiled."""
    kernels = {
        id(value): value
        for name, module in list(sys.modules.items())
        if name.startswith("chefbot.")
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    return {
        f"{kernel.py_func.__module__}.{kernel.py_func.__name__}": len(kernel.signatures)
        for kernel in kernels.values()
    }


def main() -> int:
    """Compile all groups, run the demo, and return its exit code."""
    sys.argv = ["chefbot", "demo", *sys.argv[1:]]
    for work in GROUPS.values():
        work()
    compiled = signatures()
    try:
        chefbot()
    except SystemExit as end:
        code = int(end.code or 0)
    print(json.dumps([name for name, n in signatures().items() if n > compiled.get(name, 0)]))  # noqa: T201
    return code


if __name__ == "__main__":
    sys.exit(main())
