"""Tests that results are bit-identical on three processor types, for which Numba compiles on this machine.

Numba keeps the code for each type in its cache, so that only the first run compiles.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest
from tests.support.run_hash import run_hash

REPOSITORY = Path(__file__).parents[2]
OTHER_PROCESSORS = ["haswell", "generic"] if platform.machine() in ("x86_64", "AMD64") else ["generic"]


def run(processor: str, *arguments: str) -> str:
    """Return the output of a Python program with Numba compiling for `processor`; "" means this machine's."""
    environment = dict(os.environ)
    if processor:
        environment |= {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, *arguments]
    done = subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.rotated("equal runs")
@pytest.mark.slow
@pytest.mark.parametrize("processor", OTHER_PROCESSORS)
def test_filters_are_bit_identical_on_every_processor(processor: str) -> None:
    native = run("", "-m", "tests.support.filter_hash")
    assert len(native.splitlines()) == 4
    assert run(processor, "-m", "tests.support.filter_hash") == native


@pytest.mark.long
def test_a_demo_is_bit_identical_on_every_processor(tmp_path: Path) -> None:
    """The hash covers all messages and the map."""
    hashes = set()
    for processor in ["", *OTHER_PROCESSORS]:
        out = tmp_path / (processor or "native")
        run(
            processor,
            "-m",
            "chefbot",
            "demo",
            "--headless",
            "--world",
            "room",
            "--seed",
            "3",
            "--out",
            str(out),
        )
        hashes.add(run_hash(out))
    assert len(hashes) == 1
