"""One run in a fresh process: its limits, its crash, its end with the worker, and its equal result each time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from tests.support.processes import children_of, is_alive
from tests.support.proving_runs import tiny_specs
from tests.support.waiting import wait_for

from chefbot.errors import UserError
from chefbot.proving.record import LENGTH_BYTES, RunRecord
from chefbot.proving.run_spec import RunSpec
from chefbot.proving.scenario_tasks import DriveRandomlyTask, RunLimits
from chefbot.proving.worker import dask_setup, make_run_in_process

LONG = DriveRandomlyTask(duration=50_000.0)
HANG = "import threading\nthreading.Event().wait()\n"
CRASH = """
import sys
if "chefbot.proving.child" in sys.orig_argv:
    import chefbot.proving.run
    def crash(spec, folder):
        raise RuntimeError("the wheel fell off")
    chefbot.proving.run.make_run = crash
"""


def starting_with(code: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every Python process that is started from now on run some code first."""
    (tmp_path / "sitecustomize.py").write_text(code)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))


def packed(spec: RunSpec) -> bytes:
    return msgspec.msgpack.encode(spec)


def made(spec: RunSpec) -> RunRecord:
    return msgspec.json.decode(make_run_in_process(packed(spec)).record, type=RunRecord)


@pytest.mark.rotated("equal runs")
@pytest.mark.slow
def test_equal_runs_in_two_processes_have_equal_messages() -> None:
    one = tiny_specs([3])[0]
    first = msgspec.json.decode((result := make_run_in_process(packed(one))).record, type=RunRecord)
    assert result.log == b""
    assert first.success, first.failure
    assert (first.key, first.scenario, first.seed) == (one.key, "tiny", 3)
    assert first.figures["time"] == pytest.approx(1.0, abs=0.2)
    assert "min_clearance" not in first.figures, "there is nothing to be near to"
    assert first.path and first.plan and first.memory > 50
    recorded = make_run_in_process(packed(msgspec.structs.replace(one, record=True)))
    second = msgspec.json.decode(recorded.record, type=RunRecord)
    assert recorded.log.startswith(b"\x89MCAP0")
    assert len(first.messages) == 32
    assert second.messages == first.messages, "recording changes nothing"
    assert (second.figures, second.path, second.goals) == (first.figures, first.path, first.goals)


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_drive_that_reaches_the_time_limit_has_failed() -> None:
    record = made(tiny_specs([1], limits=RunLimits(time=0.5))[0])
    assert not record.success
    assert record.failure == "the drive was not over after 0 s (the limit of 0.5 s was reached)"
    assert record.sim_time == pytest.approx(0.5, abs=1e-6)


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_run_that_hangs_ends_at_its_wall_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    starting_with(HANG, tmp_path, monkeypatch)
    record = made(tiny_specs([1], limits=RunLimits(wall_time=1.0))[0])
    assert (record.success, record.failure) == (False, "not done after 1 s on the clock")
    assert record.machine["host"]


def test_a_run_with_too_much_memory_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    starting_with("x = bytearray(b'1') * 500_000_000\n" + HANG, tmp_path, monkeypatch)
    record = made(tiny_specs([1], limits=RunLimits(memory=300.0))[0])
    assert not record.success
    assert record.failure.startswith("used ")
    assert record.failure.endswith(" MB of memory, more than 300 MB")


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_program_error_becomes_a_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    starting_with(CRASH, tmp_path, monkeypatch)
    record = made(tiny_specs([5])[0])
    assert (record.success, record.seed) == (False, 5)
    assert record.failure.strip().endswith("RuntimeError: the wheel fell off")


@pytest.mark.parametrize(
    ("code", "failure"),
    [
        ("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n", "the process ended with -11: "),
        (
            "import os\nos.write(2, b'out of luck')\nos._exit(9)\n",
            "the process ended with 9: out of luck",
        ),
        ("import os\nos._exit(0)\n", "the process ended with 0: "),
    ],
)
def test_a_process_that_dies_becomes_a_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, failure: str
) -> None:
    starting_with(code, tmp_path, monkeypatch)
    record = made(tiny_specs([1])[0])
    assert (record.success, record.failure) == (False, failure)


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_run_that_cannot_begin_is_a_failed_run() -> None:
    spec = tiny_specs([4])[0]
    scenario = msgspec.structs.replace(spec.scenario, world="nosuch")
    record = made(msgspec.structs.replace(spec, scenario=scenario))
    assert not record.success
    assert record.failure.startswith("it cannot run: no world is called 'nosuch'")


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_run_killed_from_outside_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Linux kills a process for lack of memory: that is not a result of the run."""
    kill = "import os, pathlib, signal, time\nmark = pathlib.Path('killed')\n"
    kill += "if not mark.exists():\n    mark.touch()\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    starting_with(kill, tmp_path, monkeypatch)
    record = made(tiny_specs([1])[0])
    assert "killed" not in record.failure and record.figures


def test_a_worker_with_other_code_makes_no_run() -> None:
    spec = msgspec.structs.replace(tiny_specs([1])[0], code="0123")
    with pytest.raises(UserError, match="has another version of chefbot"):
        make_run_in_process(packed(spec))


def test_no_run_leaves_a_folder_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    starting_with("import os\nos._exit(9)\n", tmp_path, monkeypatch)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    made(tiny_specs([1])[0])
    assert list((tmp_path / "temporary").iterdir()) == []


def child(folder: Path, spec: RunSpec) -> subprocess.Popen[bytes]:
    process = subprocess.Popen(
        [sys.executable, "-m", "chefbot.proving.child", str(folder)], stdin=subprocess.PIPE
    )
    assert process.stdin is not None
    process.stdin.write(len(packed(spec)).to_bytes(LENGTH_BYTES, "big") + packed(spec))
    process.stdin.flush()
    return process


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_child_ends_with_its_input(tmp_path: Path) -> None:
    process = child(tmp_path, tiny_specs([1], task=LONG, limits=RunLimits(time=100_000.0))[0])
    assert process.stdin is not None
    process.stdin.close()
    assert process.wait(300) == 1
    assert not (tmp_path / "record.json").exists()


WORKER = """
import sys
from chefbot.proving.worker import dask_setup, make_run_in_process
make_run_in_process(sys.stdin.buffer.read())
"""


@pytest.mark.rotated("runs in a child process")
@pytest.mark.slow
def test_a_child_dies_with_its_worker() -> None:
    worker = subprocess.Popen([sys.executable, "-c", WORKER], stdin=subprocess.PIPE)
    assert worker.stdin is not None
    worker.stdin.write(packed(tiny_specs([1], task=LONG, limits=RunLimits(time=100_000.0))[0]))
    worker.stdin.close()
    (run,) = wait_for(lambda: children_of(worker.pid), "the run's process")
    os.kill(worker.pid, signal.SIGKILL)
    worker.wait()
    wait_for(lambda: not is_alive(run), "the end of the run's process")


def test_a_worker_leaves_interrupts_to_the_first_process() -> None:
    before = signal.getsignal(signal.SIGINT)
    try:
        dask_setup(None)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
