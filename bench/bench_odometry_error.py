"""What each value of the simulator's `odometry_error` means: the error of odometry per metre and per turn.

The robot drives 8 m straight ahead and turns four times in place on an empty floor, with the odometry node's output
against the ground truth; median and maximum over seeds.

Run: python bench/bench_odometry_error.py [SEEDS]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import msgspec

from chefbot.control.kinematics import wheel_speeds
from chefbot.maths.angles import wrap
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

BUILT_IN = load_robot("chefbot_lidar")
SENSORS = msgspec.structs.replace(BUILT_IN.sensors, lidar=None, depth_camera=None, ultrasonic=None)
ROBOT = msgspec.structs.replace(BUILT_IN, sensors=SENSORS)
"""Without the sensors that odometry does not use."""
VALUES = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)
LENGTH, SPEED, TURNS, RATE = 8.0, 0.25, 4, 1.0
PERIOD_NS = 50_000_000
NODES = {
    "robot_state_publisher": "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode",
    "odometry": "chefbot.nodes.odometry:OdometryNode",
}


class OdometryRun:
    """A robot that is driven open loop, with its odometry."""

    def __init__(self, odometry_error: float, seed: int) -> None:
        self.system = NodeContainer(Loop(StepClock()), ROBOT, seed)
        params: dict[str, Any] = {
            "world": "empty",
            "people": 0,
            "picture_hz": 0,
            "odometry_error": odometry_error,
        }
        nodes = {name: NodeEntry(kind=kind) for name, kind in NODES.items()}
        nodes["simulator"] = NodeEntry(kind="chefbot.sim.device:SimulatorDevice", params=params)
        self.system.launch(Launch(name="measured", description="", args={}, nodes=nodes))
        self.simulator: Any = self.system.nodes["simulator"]
        self.drive(0.0, 0.0, 1.0)

    def drive(self, v: float, w: float, seconds: float) -> None:
        """Command a twist for a time, then standstill."""
        for command, duration in (((v, w), seconds), ((0.0, 0.0), 0.5)):
            left, right = wheel_speeds(*command, ROBOT)
            for _ in range(round(duration * 1e9 / PERIOD_NS)):
                message = WheelSpeeds(left=left, right=right)
                self.system.loop.publish("wheel_speeds", message, "bench", from_device=True)
                self.system.loop.run(until_ns=self.system.loop.now_ns + PERIOD_NS)

    def errors(self, v: float, w: float, seconds: float) -> tuple[float, float, float]:
        """Drive and return the error in m and rad, and the distance driven in m."""
        lookup, truth = self.system.transforms.lookup, self.simulator.simulation.truth
        before, true_before = lookup("odom", "base_link"), truth().pose
        self.drive(v, w, seconds)
        moved, truly_moved = before.between(lookup("odom", "base_link")), true_before.between(truth().pose)
        return (
            moved.distance(truly_moved),
            wrap(moved.yaw - truly_moved.yaw),
            true_before.distance(truth().pose),
        )


def main(seeds: int) -> None:
    """Print a row for each value."""
    print("odometry_error | m per m: median, max | degrees per turn: median, max")
    for value in VALUES:
        per_metre, per_turn = [], []
        for seed in range(1, seeds + 1):
            run = OdometryRun(value, seed)
            error, _, driven = run.errors(SPEED, 0.0, LENGTH / SPEED)
            per_metre.append(error / driven)
            turns = [run.errors(0.0, RATE, 2.0 * math.pi / RATE)[1] for _ in range(TURNS)]
            per_turn.append(abs(math.degrees(sum(turns))) / TURNS)
            run.system.stop()
        shown = f"{median(per_metre):.4f}, {max(per_metre):.4f} | {median(per_turn):.2f}, {max(per_turn):.2f}"
        print(f"{value:4g} | {shown}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 6)
