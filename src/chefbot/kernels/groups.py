"""Kernels in groups, each with a small workload that makes Numba compile all of it.

The workload is run by the nodes of the real robot, with messages as devices publish them, so that every
kernel is compiled for the argument types that it will be called with. Run as a module this file is a worker:
it reads names of groups, one a line, and answers each with the files that now hold its kernels (JSON).
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

from chefbot.control.people_cost import NearbyPeople, costliest_person
from chefbot.control.trajectory import TIME_STEP
from chefbot.maths.costs import Costmap
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import ObstacleScan, WheelTicks
from chefbot.msgs.geometry_msgs import Pose, PoseStamped, TransformStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import OccupancyGrid
from chefbot.msgs.sensor_msgs import Image, Imu, LaserScan, Range
from chefbot.msgs.std_msgs import Header
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.people.motion_model import MotionState
from chefbot.people.observation import Observation
from chefbot.people.visibility import seen_free
from chefbot.robot.load import load_robot
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer

HALF_SIDE, CELL = 2.5, 0.05
"""Half a side of the square room of the workload, and the resolution of its map, m."""
NODE_CLASSES = {
    "robot_state_publisher": "chefbot.nodes.robot_state_publisher:RobotStatePublisherNode",
    "odometry": "chefbot.nodes.odometry:OdometryNode",
    "depth_to_scan": "chefbot.nodes.cameras.depth_to_scan:DepthToScanNode",
    "gmapping": "chefbot.nodes.gmapping:GmappingNode",
    "graph_slam": "chefbot.nodes.graph_slam:GraphSlamNode",
    "amcl": "chefbot.nodes.amcl:AmclNode",
    "planner": "chefbot.nodes.planner:PlannerNode",
    "controller": "chefbot.nodes.controller:ControllerNode",
    "navigator": "chefbot.nodes.navigator:NavigatorNode",
    "base": "chefbot.nodes.drive_base:DriveBaseNode",
    "explorer": "chefbot.nodes.explorer:ExplorerNode",
    "people_tracker": "chefbot.nodes.people_tracker:PeopleTrackerNode",
}
"""Node classes by name."""


class KernelWorkload:
    """A few nodes on a loop of their own, of a robot that moves slowly along the x axis of the room."""

    def __init__(
        self, *names: str, robot: str = "chefbot_lidar", params: Mapping[str, Any] | None = None
    ) -> None:
        """params: of each node."""
        self.robot = load_robot(robot)
        self.loop = Loop(StepClock())
        self.system = NodeContainer(self.loop, self.robot, 1)
        nodes = {
            name: NodeEntry(kind=NODE_CLASSES[name], params=(params or {}).get(name, {}))
            for name in ("robot_state_publisher", *names)
        }
        self.system.launch(Launch(name="kernels", description="", args={}, nodes=nodes))
        self.run()

    def publish(self, topic: str, message: Message) -> None:
        """Publish a message as a device does."""
        self.loop.publish(topic, message, "bench")

    def run(self, seconds: float = 0.001) -> None:
        """Run the loop for some seconds of its time."""
        self.loop.run(until_ns=self.loop.now_ns + round(seconds * 1e9))

    def header(self, frame: str) -> Header:
        """Return a header with the current time."""
        return Header.of(self.loop.now_ns, frame)

    def publish_pose(self, x: float, frame: str = "odom") -> None:
        """Publish the robot's pose (x, 0) in `frame`; with `map`, that is the pose of odom."""
        child = "base_footprint" if frame == "odom" else "odom"
        self.publish(
            "tf", TFMessage((TransformStamped.of(self.loop.now_ns, frame, child, SE2(x, 0.0, 0.0)),))
        )
        self.run()

    def publish_scan(self, x: float = 0.0) -> None:
        """Publish a scan of the room's walls, which move along, from (x, 0)."""
        self.publish_pose(x)
        n = 360
        angles = -math.pi + 2.0 * math.pi / n * np.arange(n)
        walls = HALF_SIDE / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
        limits, turn = (0.1, 12.0), (float(angles[0]), float(angles[-1]), 2.0 * math.pi / n)
        self.publish(
            "scan", LaserScan(self.header("laser"), *turn, 0.0, 0.1, *limits, walls.astype(np.float32))
        )
        self.publish_pose(x)

    def publish_map(self) -> None:
        """Publish a map of the room with one unknown corner."""
        self.publish("map", OccupancyGrid.of(self.header("map"), room()))
        self.run()


def room() -> Grid:
    """Return the map of the room."""
    side = round(2.0 * HALF_SIDE / CELL) + 2
    cells = np.zeros((side, side), np.int8)
    cells[[0, -1], :] = 100
    cells[:, [0, -1]] = 100
    cells[-20:, -20:] = -1
    return Grid(cells, CELL, -HALF_SIDE - CELL, -HALF_SIDE - CELL)


def odometry() -> None:
    """Run odometry with wheels and gyro."""
    bench = KernelWorkload("odometry")
    for n in range(4):
        bench.publish("imu/data", Imu(bench.header("imu_link")))
        bench.publish("wheel_ticks", WheelTicks(bench.header("base_link"), 10 * n, 12 * n))
        bench.run(0.02)


def camera() -> None:
    """Take an image, a scan and an echo of a simulated robot."""
    from chefbot.sim.cameras.depth_camera import DepthRenderer
    from chefbot.sim.simulation import Simulation
    from chefbot.sim.world.load import load_any_world

    robot = load_robot("chefbot_lidar")
    spec = robot.sensors.depth_camera
    assert spec is not None
    simulation = Simulation(robot, load_any_world("room", robot))
    DepthRenderer(spec, "real", 1).frame(simulation.capture(), 0, True)
    simulation.lidar()
    simulation.echo()


def scan() -> None:
    """Convert a depth image to a scan."""
    bench = KernelWorkload("depth_to_scan")
    spec = bench.robot.sensors.depth_camera
    assert spec is not None
    header = bench.header("camera_depth_optical_frame")
    depth = np.full((spec.height, spec.width), 2.0, np.float32)
    bench.publish("camera/depth/image_raw", Image.of(header, "32FC1", depth))
    bench.run()


def monitor() -> None:
    """Check twists of a round and of a rectangular robot in the room."""
    for robot in ("chefbot_lidar", "jackal"):
        bench = KernelWorkload("base", robot=robot)
        bench.publish_scan()
        ones = [np.ones(9, np.float32)] * 5
        bench.publish("obstacles", ObstacleScan(bench.header("camera_depth_frame"), -0.5, 0.1, 8.0, *ones))
        cone = (Range.ULTRASOUND, 0.5, 0.02, 4.0, 0.2)  # ends at an obstacle 0.2 m ahead
        bench.publish("ultrasonic", Range(bench.header("ultrasonic_link"), *cone))
        bench.run()
        node: Any = bench.system.nodes["base"]
        for v, w in ((1.0, 0.0), (1.0, 0.5), (-1.0, 0.5), (0.0, 1.0)):
            node._monitor.check(v, w, SE2(HALF_SIDE - 1.0, 0.0, 0.0), bench.loop.now_ns, 0.1)


def mapping() -> None:
    """Run SLAM on a few scans."""
    bench = KernelWorkload("gmapping")
    for n in range(3):
        bench.publish_scan(1.2 * n - 1.2)
        bench.run(1.0)
    bench.run(2.0)
    node: Any = bench.system.nodes["gmapping"]
    node._slam._resample()  # otherwise it is random whether a short run resamples
    _map_error()


def _map_error() -> None:
    """Estimate the error of a map of three scans."""
    from chefbot.slam.map_error import estimate_map_error
    from chefbot.slam.recorded_scan import RecordedScan
    from chefbot.slam.session import Session

    angles = np.linspace(-math.pi, math.pi, 360, endpoint=False).astype(np.float32)
    walls = (HALF_SIDE / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))).astype(np.float32)
    poses = [SE2(1.2 * n - 1.2, 0.0, 0.0) for n in range(3)]
    scans = [RecordedScan(1.0 * n, angles, walls, pose, pose) for n, pose in enumerate(poses)]
    estimate_map_error([Session.of(scans, [True] * len(scans), 12.0, None)], poses, 0.0)


def graph_mapping() -> None:
    """Run graph SLAM there and back, so that it has submaps and closes loops."""
    short = {"graph_slam": {"graph": {"submap_travel": 0.6}}}
    bench = KernelWorkload("graph_slam", params=short)
    for n in (*range(10), *range(10, -1, -1)):
        bench.publish_scan(0.25 * n - 1.2)
        bench.run(0.1)
    bench.run(2.0)
    node: Any = bench.system.nodes["graph_slam"]
    node._slam.finish()


def costs() -> None:
    """Update the local costmap with a scan."""
    bench = KernelWorkload("controller")
    bench.publish_scan()
    node: Any = bench.system.nodes["controller"]
    node._costs.move_to(0.0, 0.0)
    node._costs.update()


def planning() -> None:
    """Plan a path on the map."""
    bench = KernelWorkload("planner", "navigator")
    _navigate(bench)


def control() -> None:
    """Plan and follow a path on the map."""
    bench = KernelWorkload(
        "planner", "controller", "navigator", robot="desk"
    )  # it has no depth camera to wait for
    _navigate(bench)
    costmap = Costmap(
        np.zeros((9, 9), np.uint8), CELL, 0.0, 0.0, np.array([[0.1, 0.0], [0.0, 0.1], [-0.1, 0.0]])
    )
    costmap.lethal_on_footprint(SE2(0.2, 0.2, 0.0))
    costmap.comes_nearer_by_rotating(SE2(0.2, 0.2, 0.0), 1.0)
    costliest_person(NearbyPeople(np.zeros((1, 7)), 0.4), np.zeros((2, 3)), TIME_STEP)


def _navigate(bench: KernelWorkload) -> None:
    """Set a goal pose in the room and run the nodes."""
    bench.publish_map()
    bench.publish_pose(0.0, "map")
    bench.publish_scan()
    bench.publish("goal_pose", PoseStamped(bench.header("map"), Pose.of(SE2(1.5, 1.0, 1.0))))
    for _ in range(20):
        bench.run(0.05)
        bench.publish_scan()  # the controller stands still without one


def exploration() -> None:
    """Choose a frontier to explore."""
    bench = KernelWorkload("explorer")
    bench.publish_map()
    bench.publish_pose(0.0, "map")
    bench.publish_pose(0.0)
    node: Any = bench.system.nodes["explorer"]
    decision = node._decide()
    if decision.goal is not None:
        node._frontier_remains(decision.goal)


def localization() -> None:
    """Localize with scans, globally and from an initial pose."""
    bench = KernelWorkload("amcl")
    bench.publish_map()
    for n in range(4):
        bench.publish_scan(0.3 * n)
        bench.run(0.5)
    node: Any = bench.system.nodes["amcl"]
    node._amcl.set_pose(SE2(0.0, 0.0, 0.0), 0.3, 0.2)
    for n in range(4):
        bench.publish_scan(0.3 * n + 1.0)
        bench.run(0.5)


def tracking() -> None:
    """Track people in scans of the room."""
    bench = KernelWorkload("people_tracker")
    bench.publish_map()
    bench.publish_pose(0.0, "map")
    for n in range(3):
        bench.publish_scan(0.3 * n)
        bench.run(0.1)
    beams = np.linspace(-math.pi, math.pi, 9)
    observation = Observation(SE2(0.0, 0.0, 0.0), beams, beams, beams, beams, beams > 0.0)
    seen_free(observation, MotionState(1.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.1))


def people() -> None:
    """Let people of all kinds walk in the simulator."""
    from chefbot.buildings.people_spec import PeopleSpec
    from chefbot.sim.simulation import Simulation
    from chefbot.sim.world.load import load_any_world

    spec = PeopleSpec(count=4, stand_and_talk=0.25, step_out=0.25, follow=0.25)
    robot = load_robot("chefbot_lidar")
    simulation = Simulation(robot, load_any_world("hotel", robot), people=spec)
    for _ in range(200):
        simulation.step()


GROUPS: Mapping[str, Callable[[], None]] = {
    "mapping": mapping,
    "camera": camera,
    "odometry": odometry,
    "scan": scan,
    "monitor": monitor,
    "costs": costs,
    "localization": localization,
    "planning": planning,
    "control": control,
    "exploration": exploration,
    "tracking": tracking,
    "people": people,
    "graph_mapping": graph_mapping,
}
"""Workloads in the order of need; of those needed together the longest first, so that the workers end
together."""
DEMO_GROUPS = tuple(name for name in GROUPS if name != "graph_mapping")
"""Groups that the demo needs."""
FIRST_PICTURE_GROUPS = ("mapping", "camera", "odometry", "scan", "monitor", "costs")
"""Groups that the first picture needs."""


GROUPS_OF_NODE: Mapping[str, tuple[str, ...]] = {
    "odometry": ("odometry",),
    "depth_to_scan": ("scan",),
    "base": ("monitor",),
    "gmapping": ("mapping",),
    "graph_slam": ("graph_mapping",),
    "amcl": ("localization",),
    "planner": ("costs", "planning"),
    "controller": ("costs", "control"),
    "explorer": ("exploration",),
    "people_tracker": ("tracking",),
}
"""Groups whose kernels a node of `KINDS` runs."""


def groups_of(kinds: Collection[str]) -> list[str]:
    """Return the groups that nodes of these classes run, in the order of `GROUPS`."""
    needed = {
        group for name, groups in GROUPS_OF_NODE.items() if NODE_CLASSES[name] in kinds for group in groups
    }
    return [group for group in GROUPS if group in needed]


def kernel_files() -> list[str]:
    """Return Numba's index files of all kernels that this process has loaded."""
    from numba.core.dispatcher import Dispatcher

    files: set[str] = set()
    for name, module in list(sys.modules.items()):
        if name.startswith("chefbot."):
            for kernel in vars(module).values():
                if isinstance(kernel, Dispatcher) and kernel.signatures and kernel.stats.cache_path:
                    stem = Path(kernel.py_func.__code__.co_filename).stem
                    pattern = f"{stem}.{kernel.py_func.__name__}-*.nbi"
                    files.update(str(file) for file in Path(kernel.stats.cache_path).glob(pattern))
    return sorted(files)


def main() -> None:
    """Compile the groups requested on stdin until it ends; Ctrl-C is handled by the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    is_nice = False
    for line in sys.stdin:
        group = line.strip()
        if group not in FIRST_PICTURE_GROUPS and not is_nice and hasattr(os, "nice"):
            os.nice(10)  # the parent computes the first picture and has priority
            is_nice = True
        GROUPS[group]()
        sys.stdout.write(json.dumps(kernel_files()) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
