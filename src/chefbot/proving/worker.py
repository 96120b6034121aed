"""What a Dask worker does: one run in a fresh process, with limits on memory and time."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO, Any, NamedTuple

import msgspec

from chefbot.errors import UserError
from chefbot.proving.record import LENGTH_BYTES, LOG_NAME, RECORD_NAME, RunRecord
from chefbot.proving.run_spec import RunSpec, code_hash, crashed

POLL_PERIOD = 0.05
"""Period at which a run's memory and time are checked, s."""
MEGABYTE = 1024 * 1024
MAX_KILLS = 3
"""Times that a run's process is killed from outside before the run counts as failed."""
LAST_LINES = 5
"""Lines of a process's error output that its record keeps."""


class RunResult(NamedTuple):
    """The record of a run as JSON, and its log if it was recorded."""

    record: bytes
    log: bytes = b""


def dask_setup(_: Any) -> None:
    """Leave Ctrl-C, which reaches all processes of a terminal, to the first one, which ends its workers.

    Dask calls it when a worker of this machine starts.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def make_run_in_process(packed: bytes) -> RunResult:
    """Make the run of a RunSpec (MessagePack) in a fresh process.

    Raises UserError if the code of this worker is not that of the spec.
    """
    spec = msgspec.msgpack.decode(packed, type=RunSpec)
    check_code(spec.code)
    with tempfile.TemporaryDirectory(prefix="chefbot_run_") as name:
        folder = Path(name)
        record = _supervised(spec, packed, folder)
        for _ in range(MAX_KILLS - 1):
            if record is not None:
                break
            record = _supervised(spec, packed, folder)
        record = record or crashed(
            spec, f"killed {MAX_KILLS} times from outside; the machine may be out of memory"
        )
        log = folder / LOG_NAME
        return RunResult(msgspec.json.encode(record), log.read_bytes() if log.exists() else b"")


def check_code(expected: str) -> None:
    """Raise UserError if this process has other code than `expected`, a `code_hash`."""
    if code_hash() != expected:
        raise UserError(
            f"the worker on {socket.gethostname()} has another version of chefbot ({code_hash()}, not {expected});"
            " install the same there"
        )


def _supervised(spec: RunSpec, packed: bytes, folder: Path) -> RunRecord | None:
    """Run the child process and end it at its limits; return None if something else killed it, as Linux does without
    memory: that is not a result of the run.
    """
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, "-m", "chefbot.proving.child", name_of(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            cwd=folder,
        )
        try:
            _send(process, packed)
            broken_limit, memory = _wait(process, spec)
        finally:
            process.kill()
            process.wait()
            if process.stdin is not None:
                process.stdin.close()
        if broken_limit:
            return crashed(spec, broken_limit)
        if process.returncode == -signal.SIGKILL:
            return None
        path = folder / RECORD_NAME
        if process.returncode or not path.exists():
            return crashed(spec, f"the process ended with {process.returncode}: {_tail(errors)}")
        record = msgspec.json.decode(path.read_bytes(), type=RunRecord)
        return msgspec.structs.replace(record, memory=round(memory, 1))


def name_of(folder: Path) -> str:
    """Return the folder's absolute path."""
    return str(folder.resolve())


def _send(process: subprocess.Popen[bytes], packed: bytes) -> None:
    """Write the spec; the pipe stays open, as the process exits when it ends."""
    assert process.stdin is not None
    try:
        process.stdin.write(len(packed).to_bytes(LENGTH_BYTES, "big") + packed)
        process.stdin.flush()
    except BrokenPipeError:
        return  # it has ended already, which its exit code shows


def _wait(process: subprocess.Popen[bytes], spec: RunSpec) -> tuple[str, float]:
    """Wait for the end of the process; return a sentence if it reached a limit first, and its largest memory, MB."""
    limits, began, largest = spec.scenario.limits, time.monotonic(), 0.0
    while process.poll() is None:
        time.sleep(POLL_PERIOD)
        if time.monotonic() - began > limits.wall_time:
            return f"not done after {limits.wall_time:.0f} s on the clock", largest
        largest = max(largest, _resident_megabytes(process.pid))
        if largest > limits.memory:
            return f"used {largest:.0f} MB of memory, more than {limits.memory:.0f} MB", largest
    return "", largest


def _resident_megabytes(pid: int) -> float:
    """Return the resident memory of a process (Linux only; elsewhere 0), MB."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * 4096 / MEGABYTE


def _tail(errors: IO[bytes]) -> str:
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    return " ".join(lines[-LAST_LINES:])
