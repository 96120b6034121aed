"""Recordings: whole, readable by others, and replayed bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest
import zstandard
from mcap_ros2.reader import read_ros2_messages

from chefbot.errors import UserError
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.runtime.replay import Replay

NODES = {"counter": "Counter", "doubler": "Doubler", "dice": "Dice", "cook": "Cook", "guest": "Guest"}


def record(path: Path, *, step: float = 1.0) -> None:
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot"), 5)
    recorder = Recorder(path, system.robot, 5)
    system.loop.add_observer(recorder)
    entries = {name: NodeEntry(kind=f"tests.runtime.toys:{kind}") for name, kind in NODES.items()}
    first = Launch(name="first", description="", args={}, nodes=entries)
    system.launch(first)
    system.loop.run(until_ns=2_500_000_000)
    del entries["guest"]
    system.loop.post(lambda: system.launch(Launch(name="second", description="", args={}, nodes=entries)))
    system.loop.run(until_ns=5_000_000_000)
    recorder.close()


def test_a_replay_is_bit_identical(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    replay = Replay(log)
    replay.run()
    assert replay.differences == []
    assert replay.compared == sum(not one.from_device for one in log.messages) > 80


def test_a_replay_finds_changed_messages(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    index = next(i for i, m in enumerate(log.messages) if m.topic == "dice" and m.time_ns > 3 * 10**9)
    changed = bytearray(log.messages[index].data)
    changed[-1] ^= 1
    log.messages[index] = log.messages[index]._replace(data=bytes(changed))
    replay = Replay(log)
    replay.run()
    assert "dice at 3" in replay.differences[0].logged


@pytest.mark.parametrize("drop", ["double", "dice"])
def test_a_replay_finds_extra_and_missing_messages(tmp_path: Path, drop: str) -> None:
    record(tmp_path / "run.mcap")
    log = read_log(tmp_path / "run.mcap")
    index = next(i for i, m in enumerate(log.messages) if m.topic == drop and m.time_ns > 3 * 10**9)
    del log.messages[index]
    replay = Replay(log)
    replay.run()
    assert replay.differences


def test_public_tools_read_the_recording(tmp_path: Path) -> None:
    record(tmp_path / "run.mcap")
    counts = [m.ros_msg.data for m in read_ros2_messages(str(tmp_path / "run.mcap"), topics=["/count"])]
    assert counts == [float(i) for i in range(1, 51)]


@pytest.mark.parametrize("keep", [0, 10, 300, 0.5, 0.99])
def test_a_damaged_log_is_refused_in_one_sentence(tmp_path: Path, keep: float) -> None:
    path = tmp_path / "run.mcap"
    record(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data)) if 0 < keep < 1 else int(keep)])
    with pytest.raises(UserError, match=r"run\.mcap"):
        read_log(path)


def test_a_log_with_a_damaged_chunk_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    record(path)
    path.write_bytes(path.read_bytes().replace(zstandard.FRAME_HEADER, bytes(4)))
    with pytest.raises(UserError, match="is damaged or cut off"):
        read_log(path)


def test_a_missing_log_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="No such file"):
        read_log(tmp_path / "none.mcap")
