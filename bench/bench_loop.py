"""Cost of the loop: one message from node to node, by size, by number of subscribers, recorded or not.

Run: python bench/bench_loop.py
"""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from chefbot.maths.se2 import SE2
from chefbot.msgs.geometry_msgs import Pose, PoseWithCovariance
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.sensor_msgs import LaserScan
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import In, Node, NoParams, Out, topic
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorder import Recorder

MESSAGES, REPEATS = 5000, 9
TARGET = 20.0
"""Microseconds for a message through two nodes."""
ROBOT = load_robot("chefbot_lidar")


class First(Node):
    """Receives and forwards a message."""

    params: NoParams
    start_here: In[Message] = topic("start_here")
    passed: Out[Message] = topic("passed")

    def on_start_here(self, message: Message) -> None:
        """Forward the message."""
        self.publish("passed", message)


class Second(Node):
    """Receives and stores a message."""

    params: NoParams
    passed: In[Message]

    def on_passed(self, message: Message) -> None:
        """Store the message."""
        self.kept = message


def system_with(listeners: int) -> NodeContainer:
    """Return a loop with one forwarding node and this number of subscribers."""
    system = NodeContainer(Loop(StepClock()), ROBOT, 1)
    nodes = {"first": NodeEntry(kind=f"{__name__}:First")}
    nodes |= {f"second_{i}": NodeEntry(kind=f"{__name__}:Second") for i in range(listeners)}
    system.launch(Launch(name="bench", description="", args={}, nodes=nodes))
    return system


def measure(message: Message, listeners: int = 1, record: Path | None = None) -> tuple[float, float]:
    """Return (median, minimum) CPU time in us from a publication to its last subscriber."""
    system = system_with(listeners)
    recorder = Recorder(record, ROBOT, 1) if record else None
    if recorder is not None:
        system.loop.add_observer(recorder)
    times = []
    for _ in range(REPEATS):
        begun = time.thread_time()
        for _ in range(MESSAGES):
            system.loop.publish("start_here", message, "bench")
            system.loop.run()
        times.append((time.thread_time() - begun) / MESSAGES * 1e6)
    if recorder is not None:
        recorder.close()
    return statistics.median(times), min(times)


def messages() -> dict[str, Message]:
    """Return messages of increasing size."""
    header = Header.of(1, "map")
    odometry = Odometry(header, "base_link", PoseWithCovariance(Pose.of(SE2(1.0, 2.0, 0.5))))
    scans = {
        f"LaserScan, {n} beams": LaserScan(
            header, -3.0, 3.0, 6.0 / n, 0.0, 0.1, 0.1, 12.0, np.ones(n, np.float32)
        )
        for n in (360, 3600, 36000)
    }
    return {"String": String("x"), "Odometry": odometry, **scans}


def print_sizes() -> None:
    """Print one subscriber, every size, without and with a recording."""
    print(
        f"{'message (one listener)':28}{'bytes':>8}{'median us':>11}{'min us':>8}{'recorded':>10}{'min':>8}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for name, message in messages().items():
            plain, recorded = measure(message), measure(message, record=Path(folder) / "log.mcap")
            figures = f"{plain[0]:11.1f}{plain[1]:8.1f}{recorded[0]:10.1f}{recorded[1]:8.1f}"
            print(f"{name:28}{len(message.to_cdr()):8}{figures}")


def print_listeners() -> None:
    """Print the times by number of subscribers."""
    print(f"\n{'subscribers':28}{'median us':>11}{'min us':>8}")
    for listeners in (1, 2, 4, 8, 16):
        median, minimum = measure(String("x"), listeners)
        print(f"{listeners:<28}{median:11.1f}{minimum:8.1f}")


def main() -> None:
    """Print all tables."""
    print(f"one core used, {os.cpu_count()} present, load {os.getloadavg()[0]:.1f}; CPU time of a message")
    print(f"through two nodes and two topics; target {TARGET:.0f} us unrecorded\n")
    print_sizes()
    print_listeners()


if __name__ == "__main__":
    main()
