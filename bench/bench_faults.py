"""What the robot does when a fault occurs: it explores a world, and in each run one fault lasts for a while.

For each fault: collisions, the distance driven during the fault and after it, exceptions of nodes, and the texts with
which the robot names the fault.

Run: python bench/bench_faults.py [WORD ...]   (only faults of these words)
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from chefbot.maths.se2 import SE2
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Loop, Publication
from chefbot.runtime.node_container import NodeContainer
from chefbot.sim.faults import events as e
from chefbot.sim.faults.node_faults import inject
from chefbot.sim.faults.schedule import describe

AT, UNTIL, END = 20.0, 32.0, 60.0
LASTING = {"at": AT, "until": UNTIL}
SENSORS = ("lidar", "depth_camera", "ultrasonic", "imu", "wheel_encoders")
NODES = ("controller", "planner", "gmapping", "odometry", "base", "navigator", "explorer")
EVENTS: list[Any] = [
    *(e.SensorStop(sensor=sensor, **LASTING) for sensor in SENSORS),
    *(e.SensorFreeze(sensor=sensor, **LASTING) for sensor in SENSORS[:4]),
    *(e.SensorLate(sensor=sensor, **LASTING) for sensor in SENSORS),
    *(e.SensorNoise(sensor=sensor, **LASTING) for sensor in SENSORS),
    *(e.SensorHalfBlind(sensor=sensor, **LASTING) for sensor in SENSORS[:2]),
    e.SensorOffset(sensor="lidar", yaw=0.3, **LASTING),
    e.SensorOffset(sensor="depth_camera", yaw=0.3, **LASTING),
    e.SensorOffset(sensor="lidar", range=0.3, **LASTING),
    e.SensorOffset(sensor="ultrasonic", range=0.3, **LASTING),
    e.SensorOffset(sensor="imu", rate=0.1, **LASTING),
    *(e.SensorUpsideDown(sensor=sensor, **LASTING) for sensor in ("lidar", "depth_camera", "imu")),
    e.WheelSlip(wheel="left", share=0.02, **LASTING),
    e.WheelSlip(wheel="both", share=0.02, **LASTING),
    e.WheelStall(wheel="left", **LASTING),
    e.Bump(at=AT, impulse=5.0),
    e.Carried(at=AT),
    e.VoltageDrop(share=0.75, **LASTING),
    e.WrongVoltageReading(voltage=14.0, **LASTING),
    e.WrongVoltageReading(voltage=9.0, **LASTING),
    e.BoardUnplugged(**LASTING),
    e.BitErrors(rate=0.001, **LASTING),
    e.BitErrors(rate=0.01, **LASTING),
    *(
        e.ClockJump(clock=c, seconds=s, **LASTING)
        for c in ("board", "lidar", "depth_camera")
        for s in (5.0, -5.0)
    ),
    *(kind(node=node, **LASTING) for kind in (e.NodeKilled, e.NodeHung) for node in NODES),
    *(e.Slow(node=node, seconds=0.3, **LASTING) for node in NODES),
    e.LinkBlackHole(link="controller", **LASTING),
    e.LinkCut(link="gmapping", **LASTING),
    e.Slow(link="base", seconds=0.5, **LASTING),
]


class FaultRecord:
    """Collects what a run shows."""

    def __init__(self) -> None:
        self.poses: list[tuple[float, SE2]] = []
        self.collisions: list[tuple[float, str]] = []
        self.texts: dict[str, float] = {}

    def __call__(self, publication: Publication) -> None:
        """Take one publication."""
        message: Any = publication.message
        time = publication.time_ns / 1e9
        if publication.topic == "ground_truth":
            self.poses.append((time, message.pose.pose.se2))
        elif publication.topic == "collision":
            self.collisions.append((round(time, 1), message.name))
        elif publication.topic == "controller/standing" and message.data:
            self._add(message.data, time)
        elif publication.topic == "diagnostics":
            for status in message.status:
                if status.level and status.message:
                    self._add(status.message, time)
        elif publication.topic in ("simulation/notice", "base/notice"):
            self._add(message.data, time)
        elif publication.topic == "navigation_status" and message.reason:
            self._add(message.reason, time)

    def _add(self, text: str, time: float) -> None:
        if time >= AT:
            self.texts.setdefault(text, round(time, 1))

    def distance(self, begin: float, end: float) -> float:
        """Return the distance driven in [begin, end), m."""
        poses = [pose for time, pose in self.poses if begin <= time < end]
        return sum(a.distance(b) for a, b in pairwise(poses))


def run(events: list[Any]) -> None:
    """Run the exploration with events and print what happened."""
    system = NodeContainer(Loop(StepClock()), load_robot("chefbot_lidar"), 3)
    system.isolate_faults(lambda fault: print("   EXCEPTION", fault.sentence))
    record = FaultRecord()
    system.loop.add_observer(record)
    arguments = {
        "headless": "true",
        "people": "0",
        "pictures": "0",
        "world": "hotel",
        "robot": "chefbot_lidar",
    }
    system.launch(inject(load_launch("explore", arguments), events))
    system.loop.run(until_ns=round(END * 1e9))
    counts = dict(system.faults.counts) if system.faults else {}
    distances = [record.distance(*span) for span in ((0.0, AT), (AT, UNTIL), (UNTIL, END))]
    print(
        "   distance before, during, after:",
        *(f"{distance:.2f} m" for distance in distances),
        "| collisions",
        record.collisions,
    )
    for text, time in record.texts.items():
        print(f"   {time:5.1f} s {text}")
    if counts:
        print("   exceptions", counts)
    system.stop()


if __name__ == "__main__":
    chosen = [
        event for event in EVENTS if len(sys.argv) < 2 or str(event.__struct_config__.tag) in sys.argv[1:]
    ]
    if len(sys.argv) < 2:
        print("healthy")
        run([])
    for event in chosen:
        print(
            describe(event),
            {k: getattr(event, k) for k in event.__struct_fields__ if k not in ("at", "until")},
        )
        run([event])
        sys.stdout.flush()
