"""What several test folders need."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("desk", deadline=None)  # a busy machine is no finding
settings.register_profile("ci", deadline=None, derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "desk")
"""A red run must mean a change, not bad luck; at a desk chance goes on searching."""

sys.dont_write_bytecode = False  # else every program that a test starts is compiled first, as are the tests
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 200)  # tests that run at once do not hear each other
os.environ["CHEFBOT_WIRE_PORT"] = str(21000 + os.getpid() % 10000)

os.environ["CHEFBOT_STATE"] = tempfile.mkdtemp(prefix="chefbot_state_")  # no test stops the owner's robot

REPOSITORY = Path(__file__).parent.parent


def shared_file(name: str) -> Path:
    """A file of the benchmark data; skips the test where it is absent."""
    folder = Path(os.environ.get("CHEFBOT_SHARED", REPOSITORY.parent / "shared"))
    path = folder / name
    if not path.exists():
        pytest.skip(f"needs the benchmark file {name}; set CHEFBOT_SHARED to the folder that holds it")
    return path


@pytest.fixture
def shared():  # type: ignore[no-untyped-def]
    """`shared("data/slam/intel.log.gz")` is the path of a benchmark file."""
    return shared_file
