"""`chefbot doctor kernels`: compile the kernels ahead of the first launch."""

from __future__ import annotations

from rich.console import Console

from chefbot.kernels.precompile import compile_kernels

console = Console(highlight=False)


def compile_all() -> None:
    """Compile the kernels that are not in the cache, with a progress display."""
    compile_kernels(console)
    console.print("All kernels are compiled.")
