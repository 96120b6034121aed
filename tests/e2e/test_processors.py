"""One seed gives the same bytes whatever the processor: Numba compiles for three of them on this one.

Numba keeps the code for each of them in its cache, so that only the first run compiles.
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
OTHERS = ["haswell", "generic"] if platform.machine() in ("x86_64", "AMD64") else ["generic"]


def run(processor: str, *arguments: str) -> str:
    """What a Python program prints when Numba compiles for `processor`; the empty text is this one."""
    environment = dict(os.environ)
    if processor:
        environment |= {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    command = [sys.executable, *arguments]
    done = subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_filters_are_bit_identical_on_every_processor() -> None:
    here = run("", "-m", "tests.support.filter_hash")
    assert len(here.splitlines()) == 4
    assert {
        processor: run(processor, "-m", "tests.support.filter_hash") for processor in OTHERS
    } == dict.fromkeys(OTHERS, here)


@pytest.mark.long
def test_a_demo_is_bit_identical_on_every_processor(tmp_path: Path) -> None:
    """From exploring to the delivery, all messages and the map."""
    hashes = set()
    for processor in ["", *OTHERS]:
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
