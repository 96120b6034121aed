"""What is printed goes into files and pipes, too: `chefbot robot export urdf > robot.urdf`."""

import subprocess
import sys
from pathlib import Path

import pytest

FULL = Path("/dev/full")


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize("verb", [["robot", "export", "urdf"], ["--version"]])
def test_a_full_disk_on_stdout_is_reported_in_one_sentence(verb: list[str]) -> None:
    with FULL.open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "chefbot", *verb],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr == "chefbot: standard output could not be written: No space left on device\n"
