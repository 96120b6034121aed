"""Tests that a robot with faults of nodes and links is replayed bit for bit: the log holds all that it needs."""

from __future__ import annotations

from pathlib import Path

import pytest

from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, load_launch
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import LAUNCH_TOPIC, NodeContainer
from chefbot.runtime.recorded_log import read_log
from chefbot.runtime.recorder import Recorder
from chefbot.runtime.replay import Replay
from chefbot.sim.faults import events as e
from chefbot.sim.faults.node_faults import fault_events, inject

ARGUMENTS = {"headless": "true", "people": "0", "pictures": "0", "world": "room", "robot": "chefbot_lidar"}
EVENTS: list[e.FaultEvent] = [
    e.NodeHung(at=2.0, until=3.0, node="planner"),
    e.NodeKilled(at=3.5, until=4.5, node="controller"),
    e.Slow(at=4.0, until=5.0, node="gmapping", seconds=0.3),
    e.BitErrors(at=5.0, until=6.0, rate=0.001),
    e.LinkCut(at=5.5, until=6.5, link="navigator"),
    e.NodeHung(at=6.5, until=7.0, node="depth_to_scan"),
    e.NodeKilled(at=7.5, until=8.5, node="odometry"),
]


def record(path: Path) -> None:
    system = NodeContainer(Loop(StepClock()), load_robot(ARGUMENTS["robot"]), 3)
    recorder = Recorder(path, system.robot, 3)
    system.loop.add_observer(recorder)
    system.launch(inject(load_launch("explore", ARGUMENTS), EVENTS))
    system.loop.run(until_ns=10_000_000_000)
    recorder.close()
    system.stop()


@pytest.mark.rotated("equal runs")
@pytest.mark.slow
def test_a_robot_with_faults_is_replayed_bit_for_bit(tmp_path: Path) -> None:
    paths = [tmp_path / "first.mcap", tmp_path / "second.mcap"]
    for path in paths:
        record(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    log = read_log(paths[0])
    (launch,) = [item.data for item in log.messages if item.topic == LAUNCH_TOPIC]
    assert fault_events(Launch.from_json(String.from_cdr(launch).data)) == EVENTS
    replay = Replay(log)
    replay.run()
    assert replay.differences == [] and replay.compared > 1000
