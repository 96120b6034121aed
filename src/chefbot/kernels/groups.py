"""The kernels in groups, each with a little work that makes Numba compile all of it.

The work is done by the very nodes of the running robot, with messages as devices send them, so that every
kernel is compiled for the types of arguments that it will meet. Run as a module this file is a worker: it
reads names of groups, one a line, and answers each with the files that now hold its kernels (JSON).
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import WheelTicks
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import Image, Imu, LaserScan
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import System

HALF, CELL = 2.5, 0.05
"""Metres: half a side of the square room in which the work is done, and a cell of its map."""
KINDS = {
    "frames": "chefbot.nodes.robot_state_publisher:FramesNode",
    "odometry": "chefbot.nodes.odometry:OdometryNode",
    "depth_to_scan": "chefbot.nodes.depth_to_scan:DepthToScanNode",
    "gmapping": "chefbot.nodes.gmapping:GmappingNode",
    "amcl": "chefbot.nodes.amcl:AmclNode",
    "planner": "chefbot.nodes.planner:PlannerNode",
    "controller": "chefbot.nodes.controller:ControllerNode",
    "navigator": "chefbot.nodes.navigator:NavigatorNode",
    "explorer": "chefbot.nodes.explorer:ExplorerNode",
}


class Bench:
    """A few nodes on a loop of their own, in a robot that creeps along the x axis of the room."""

    def __init__(self, *names: str, robot: str = "chefbot_lidar") -> None:
        self.robot = load_robot(robot)
        self.loop = Loop(StepClock())
        self.system = System(self.loop, self.robot, 1)
        nodes = {name: NodeEntry(kind=KINDS[name]) for name in ("frames", *names)}
        self.system.launch(Launch(name="kernels", about="", args={}, nodes=nodes))
        self.run()

    def say(self, topic: str, message: Message) -> None:
        """As a device would."""
        self.loop.publish(topic, message, "bench")

    def run(self, seconds: float = 0.001) -> None:
        """All that is due."""
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * 1e9))

    def header(self, frame: str) -> Header:
        """Now."""
        return Header.of(self.loop.now_ns, frame)

    def move(self, x: float, frame: str = "odom") -> None:
        """The robot stands at (x, 0) in `frame`; with `map`, that is odom's place."""
        child = "base_footprint" if frame == "odom" else "odom"
        self.say("tf", TFMessage((TransformStamped.of(self.loop.now_ns, frame, child, SE2(x, 0.0, 0.0)),)))
        self.run()

    def look(self, x: float = 0.0) -> None:
        """A scan of the room's walls from (x, 0), as if they moved along."""
        self.move(x)
        n = 360
        angles = -math.pi + 2.0 * math.pi / n * np.arange(n)
        walls = HALF / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
        limits, turn = (0.1, 12.0), (float(angles[0]), float(angles[-1]), 2.0 * math.pi / n)
        self.say("scan", LaserScan(self.header("laser"), *turn, 0.0, 0.1, *limits, walls.astype(np.float32)))
        self.move(x)

    def show_map(self) -> None:
        """Of the room, one corner of it not seen yet."""
        self.say("map", OccupancyGrid.of(self.header("map"), room()))
        self.run()


def room() -> Grid:
    """Its map."""
    side = round(2.0 * HALF / CELL) + 2
    cells = np.zeros((side, side), np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    cells[-20:, -20:] = -1
    return Grid(cells, CELL, -HALF - CELL, -HALF - CELL)


def odometry() -> None:
    """Wheels and gyro."""
    bench = Bench("odometry")
    for n in range(4):
        bench.say("imu/data", Imu(bench.header("imu_link")))
        bench.say("wheel_ticks", WheelTicks(bench.header("base_link"), 10 * n, 12 * n))
        bench.run(0.02)


def camera() -> None:
    """The simulated camera's pictures."""
    from chefbot.sim.depth_camera import DepthRenderer
    from chefbot.sim.simulation import Simulation
    from chefbot.sim.world.load import load_any_world

    robot = load_robot("chefbot")
    spec = robot.sensors.depth_camera
    assert spec is not None
    DepthRenderer(spec, "real", 1).frame(Simulation(robot, load_any_world("room", robot)).capture(), 0, True)


def scan() -> None:
    """Depth to scans."""
    bench = Bench("depth_to_scan")
    spec = bench.robot.sensors.depth_camera
    assert spec is not None
    header = bench.header("camera_depth_optical_frame")
    depth = np.full((spec.height, spec.width), 2.0, np.float32)
    bench.say("camera/depth/image_raw", Image.of(header, "32FC1", depth))
    bench.run()


def mapping() -> None:
    """Scans to a map."""
    bench = Bench("gmapping")
    for n in range(3):
        bench.look(1.2 * n - 1.2)
        bench.run(1.0)
    bench.run(2.0)
    node: Any = bench.system.nodes["gmapping"]
    node._slam._resample()  # else it is a matter of chance whether a short run does so


def costs() -> None:
    """What is in the way."""
    bench = Bench("controller")
    bench.look()
    node: Any = bench.system.nodes["controller"]
    node._costs.move_to(0.0, 0.0)
    node._costs.update()


def planning() -> None:
    """Ways on the map."""
    bench = Bench("planner", "navigator")
    _send(bench)


def control() -> None:
    """Ways to wheels."""
    bench = Bench("planner", "controller", "navigator")
    _send(bench)


def _send(bench: Bench) -> None:
    """To a pose in the room."""
    bench.show_map()
    bench.move(0.0, "map")
    bench.look()
    bench.say("goal_pose", PoseStamped(bench.header("map"), Pose.of(SE2(1.5, 1.0, 1.0))))
    for _ in range(20):
        bench.run(0.05)
        bench.move(0.0)


def exploration() -> None:
    """Where to look next."""
    bench = Bench("explorer")
    bench.show_map()
    bench.move(0.0, "map")
    bench.move(0.0)
    node: Any = bench.system.nodes["explorer"]
    decision = node._decide()
    if decision.goal is not None:
        node._worth(decision.goal)


def localization() -> None:
    """Scans to a pose on the map, from nothing and from a click."""
    bench = Bench("amcl")
    bench.show_map()
    for n in range(4):
        bench.look(0.3 * n)
        bench.run(0.5)
    node: Any = bench.system.nodes["amcl"]
    node._amcl.set_pose(SE2(0.0, 0.0, 0.0), 0.3, 0.2)
    for n in range(4):
        bench.look(0.3 * n + 1.0)
        bench.run(0.5)


GROUPS: Mapping[str, Callable[[], None]] = {
    "mapping": mapping,
    "camera": camera,
    "odometry": odometry,
    "scan": scan,
    "costs": costs,
    "localization": localization,
    "planning": planning,
    "control": control,
    "exploration": exploration,
}
"""In the order of need; of what is needed together the longest first, so that the workers end together."""
FIRST = ("mapping", "camera", "odometry", "scan", "costs")
"""Without these there is no first picture."""


NEEDS: Mapping[str, tuple[str, ...]] = {
    "odometry": ("odometry",),
    "depth_to_scan": ("scan",),
    "gmapping": ("mapping",),
    "amcl": ("localization",),
    "planner": ("planning",),
    "controller": ("costs", "control"),
    "explorer": ("exploration",),
}
"""Groups whose kernels a node of `KINDS` runs."""


def groups_of(kinds: Collection[str]) -> list[str]:
    """What nodes of these classes run, in the order of `GROUPS`."""
    needed = {group for name, groups in NEEDS.items() if KINDS[name] in kinds for group in groups}
    return [group for group in GROUPS if group in needed]


def kernel_files() -> list[str]:
    """Numba's index files of all kernels that this process has met."""
    from numba.core.dispatcher import Dispatcher

    found: set[str] = set()
    for name, module in list(sys.modules.items()):
        if name.startswith("chefbot."):
            for kernel in vars(module).values():
                if isinstance(kernel, Dispatcher) and kernel.signatures and kernel.stats.cache_path:
                    stem = Path(kernel.py_func.__code__.co_filename).stem
                    pattern = f"{stem}.{kernel.py_func.__name__}-*.nbi"
                    found.update(str(file) for file in Path(kernel.stats.cache_path).glob(pattern))
    return sorted(found)


def main() -> None:
    """Compile what is asked for on stdin until it ends; Ctrl-C is the parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    polite = False
    for line in sys.stdin:
        group = line.strip()
        if group not in FIRST and not polite and hasattr(os, "nice"):
            os.nice(10)  # the first picture is being made by the parent, which goes before
            polite = True
        GROUPS[group]()
        sys.stdout.write(json.dumps(kernel_files()) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
