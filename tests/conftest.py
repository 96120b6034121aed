"""What several test folders need."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import gc
import os
import signal
import sys
import tempfile
from pathlib import Path

import pytest
import typer.main
from hypothesis import settings

from tests.support.ros_fixtures import fleet, network, other, peer, port, wire
from tests.support.rotation import commit_of, is_rotating, split
from tests.support.same_examples import ignore_constants_of_the_code

__all__ = ["fleet", "network", "other", "peer", "port", "wire"]

settings.register_profile("search", deadline=None)  # a busy machine is not a finding
settings.register_profile("thorough", settings.get_profile("search"), derandomize=True)
settings.register_profile("same", settings.get_profile("thorough"), max_examples=30)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "same")
"""A red run must mean a change, not bad luck: only `make test-long` searches by chance. The safety gate: thorough."""
settings.load_profile(PROFILE)
if PROFILE != "search":
    ignore_constants_of_the_code()

typer.main.get_command = functools.cache(typer.main.get_command)  # it takes 0.1 s, and commands stay the same

sys.dont_write_bytecode = False  # else every program that a test starts is compiled first, as are the tests
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


_LOCKS: list[int] = []


def own_number() -> int:
    """From 1 to 200, of no other process that tests at the moment: kept by a lock until this one ends."""
    for number in range(1, 201):
        path = Path(tempfile.gettempdir(), f"chefbot_tests_{number}.lock")
        handle = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC)
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _LOCKS.append(handle)
            return number
        os.close(handle)
    raise RuntimeError("200 processes test at once")


os.environ["ROS_DOMAIN_ID"] = str(own_number())  # tests that run at once cannot communicate
os.environ["CHEFBOT_WIRE_PORT"] = str(21000 + int(os.environ["ROS_DOMAIN_ID"]))

_STATE = tempfile.TemporaryDirectory(prefix="chefbot_state_", ignore_cleanup_errors=True)
os.environ["CHEFBOT_STATE"] = _STATE.name  # no test stops the owner's robot

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for what a shell starts in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)

gc.disable()  # the tests and the modules under test stay: looking for garbage among them takes seconds


def pytest_collection_finish() -> None:
    """Begin to collect garbage, of what the tests leave only."""
    gc.freeze()
    gc.enable()


REPOSITORY = Path(__file__).parent.parent


COMMIT = commit_of(REPOSITORY) if is_rotating() else ""


def pytest_report_header() -> str:
    """States that not all cases run."""
    return f"Of each rotated test runs one case, chosen by commit {COMMIT[:8]}." if is_rotating() else ""


@pytest.hookimpl(trylast=True)  # tests that do not run are left out before, else the shares are uneven
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out cases of rotated tests, and deals the slow tests out to the workers: at the end all are busy.

    pytest-xdist gives every worker a contiguous part and lets those that are done take from the others. Tests of one
    folder stay together, so that launches which must keep pace do not all run at once. The longest, of whole demos,
    come first: one that begins last would keep a single worker busy.
    """
    if is_rotating():
        items[:], left_out = split(items, COMMIT)
        config.hook.pytest_deselected(items=left_out)
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    slow = [item for item in items if item.get_closest_marker("slow")]
    slow.sort(key=lambda item: not item.path.is_relative_to(REPOSITORY / "tests" / "e2e"))
    fast = [item for item in items if not item.get_closest_marker("slow")]
    shares = [
        part[len(part) * i // workers : len(part) * (i + 1) // workers]
        for i in range(workers)
        for part in (slow, fast)
    ]
    items[:] = [item for share in shares for item in share]


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
