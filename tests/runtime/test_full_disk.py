"""A disk that is full: what was recorded before is whole, and the robot goes on."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from chefbot.launcher.session import DIAGNOSTICS_PERIOD_NS, session, start
from chefbot.msgs.diagnostic_msgs import WARN, DiagnosticArray
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Publication
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.replay import Replay
from chefbot.storage.atomic_files import StorageError
from chefbot.storage.mcap_writer import McapWriter

needs_root = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("mount") is None, reason="needs root to mount a small disk"
)


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """No file of this process may grow beyond so many bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@contextmanager
def disk_of(folder: Path, size: str) -> Iterator[Path]:
    """A file system of its own."""
    folder.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], capture_output=True, text=True
    )
    if done.returncode:
        pytest.skip(f"no disk of its own here: {done.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def messages_in(path: Path) -> list[bytes]:
    """Of a file that is whole: all checksums, and as many messages as its summary states."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [message.data for _, _, message in reader.iter_messages(log_time_order=False)]
        summary = reader.get_summary()
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == len(found)
    return found


def fill(path: Path, seed: int, largest: int) -> list[bytes]:
    """Messages of chance until the disk is full; those that were taken."""
    rng = np.random.default_rng(seed)
    file = McapWriter(path, lambda: ("last", {"words": "x" * 100}))
    file.reserve(200)
    taken: list[bytes] = []
    channels: list[int] = []
    with pytest.raises(StorageError, match=r"stopped: .*; free space or record elsewhere$"):
        file.metadata("first", {"a": "b"})
        while True:
            if not channels or rng.random() < 0.02:
                channels.append(
                    file.channel(f"/{len(channels)}", "std_msgs/msg/String", "string data", {"x": "y" * 50})
                )
            if rng.random() < 0.01:
                file.flush()
            data = rng.bytes(rng.integers(1, largest)) if rng.random() < 0.7 else bytes(largest)
            file.add(int(rng.choice(channels)), data, len(taken), len(taken), len(taken))
            taken.append(data)
    assert file.closed
    return taken


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(8_000, 3_000_000), st.integers(0, 2**31), st.sampled_from([20, 2_000, 50_000, 600_000]))
@pytest.mark.slow
def test_a_size_limited_log_is_complete_up_to_its_limit(
    tmp_path: Path, limit: int, seed: int, largest: int
) -> None:
    path = tmp_path / "run.mcap"
    if largest == 20:
        limit = min(limit, 200_000)
    with files_up_to(limit):
        taken = fill(path, seed, largest)
    assert messages_in(path) == taken
    size = path.stat().st_size
    assert size <= limit
    assert path.stat().st_blocks * 512 <= size + 5 * 4096, "what was not used is given back"


@needs_root
@pytest.mark.parametrize("promised", [True, False])
@pytest.mark.parametrize("largest", [2_000, 300_000])
def test_a_log_on_a_full_disk_is_complete(
    tmp_path: Path, largest: int, promised: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the system promises no room, as on a Mac: then it is tried with zeros."""
    if not promised:
        monkeypatch.setattr("chefbot.storage.disk_reservation.ctypes.CDLL", lambda *_, **__: object())
    with disk_of(tmp_path / "disk", "1m") as disk:
        taken = fill(disk / "run.mcap", 1, largest)
        assert messages_in(disk / "run.mcap") == taken
        (disk / "something").write_bytes(b"else")  # there is room for a word again


def test_the_robot_continues_and_reports_when_its_log_is_full(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, published = tmp_path / "run.mcap", list[Publication]()
    nodes = {
        name: NodeEntry(kind=f"tests.runtime.toys:{name.title()}") for name in ("counter", "doubler", "dice")
    }
    with files_up_to(60_000), session(load_robot("chefbot"), 1, "simulation", 0.0, path) as system:
        system.loop.add_observer(published.append)
        start(system, Launch(name="toys", description="", args={}, nodes=nodes))
        system.loop.run(until_ns=200_000_000_000)
    warnings = [one for one in published if isinstance(one.message, DiagnosticArray)]
    assert {(one.message.status[0].name, one.message.status[0].level) for one in warnings} == {
        ("recording", WARN)
    }
    full_ns = warnings[0].time_ns
    assert 5_000_000_000 < full_ns < 190_000_000_000
    assert len(warnings) == 1 + (200_000_000_000 - full_ns) // DIAGNOSTICS_PERIOD_NS, (
        "a late-joining subscriber receives it too"
    )
    assert sum(one.topic == "double" for one in published) == 2000, "nothing else has changed"
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 2 and len(set(lines)) == 1 and "the robot continues" in lines[0]
    replay = Replay(read_log(path))
    replay.run()
    assert not replay.differences and replay.compared > 100


def test_a_log_is_written_without_fallocate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Mac's C library has no fallocate."""
    monkeypatch.setattr("chefbot.storage.disk_reservation.ctypes.CDLL", lambda *_, **__: object())
    file = McapWriter(tmp_path / "some.mcap")
    channel = file.channel("chatter", "std_msgs/msg/String", "string data", {})
    file.add(channel, b"\0\1\0\0", 1, 1, 1)
    file.close()
    assert messages_in(tmp_path / "some.mcap") == [b"\0\1\0\0"]
