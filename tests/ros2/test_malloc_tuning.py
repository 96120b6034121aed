"""Large messages use the same memory again."""

from __future__ import annotations

import subprocess
import sys

MEASURE = """
import resource, sys
from chefbot.ros2.rmw.malloc_tuning import tune_malloc
if sys.argv[1] == "kept":
    tune_malloc()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def pictures():
    one = bytes(1 << 20)
    return one + b"x", bytes(1 << 20)
pictures()
before = faults()
for _ in range(20):
    pictures()
print(faults() - before)
"""


def faults(how: str) -> int:
    done = subprocess.run([sys.executable, "-c", MEASURE, how], capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_repeated_pictures_reuse_the_same_memory() -> None:
    assert faults("kept") < 1000 < faults("given back")
