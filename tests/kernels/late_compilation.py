"""Print, as a JSON list, the kernels that a demo compiles after all groups have been compiled.

`python -m tests.kernels.late_compilation ROBOT FOLDER` is a process of its own, as earlier tests in a process may
have compiled a kernel that no group compiles.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from numba.core.dispatcher import Dispatcher

from chefbot.demo.demo import DemoOptions
from chefbot.demo.run import run_demo
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
    robot, folder = sys.argv[1:]
    for work in GROUPS.values():
        work()
    compiled = signatures()
    code = run_demo(DemoOptions("room", robot, 1, True, "max", Path(folder), "real", 0, 8080))
    print(json.dumps([name for name, n in signatures().items() if n > compiled.get(name, 0)]))  # noqa: T201
    return code


if __name__ == "__main__":
    sys.exit(main())
