"""`chefbot launch --supervised`: the same command without the option, as a child that is started again."""

from __future__ import annotations

import sys

from rich.console import Console

from chefbot.supervision.supervised_launch import run_supervised

console = Console(highlight=False, soft_wrap=True)


def run_again_after_crashes() -> int:
    """Run this process's command as a supervised child, and return its exit code."""
    arguments = [argument for argument in sys.argv[1:] if argument != "--supervised"]
    return run_supervised(arguments, lambda sentence: console.print(sentence, markup=False))
