"""Delay of the base's and the controller's loops while SLAM uses a whole core, in several processes, at real time.

A built robot's launch on the emulated board: base, odometry and the drivers of board and lidar in the main
process, the controller in a second one, the mapper in a third; and the simulated hotel with the simulator in the
base's process. The mapper's process is idle, or runs a busy loop, or maps the lidar's scans while the robot turns,
without and with a busy thread beside it. A node beside the base (20 Hz) and one beside the controller (10 Hz, while
it turns the robot) report when each command was published; delays are relative to the earliest command of a run.

Run: python bench/bench_control_lateness.py [SECONDS]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from chefbot.demo.processes import cpu_seconds
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.nav2_msgs import Spin, Spin_Goal
from chefbot.msgs.std_msgs import Float64
from chefbot.ros2.rmw.action_client import ActionClient
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.lateness import late_ms  # noqa: E402
from tests.chaos.launch_process import LaunchProcess, free_port, wait_for  # noqa: E402
from tests.devices.emulated import Emulator  # noqa: E402

WITNESS = "tests.chaos.lateness:LatenessNode"
LOOPS = {"base": "cmd_vel", "controller": "cmd_vel_nav"}
SETTLE = 5.0
"""Time after the first command in which kernels are still loaded, s."""
BUSY, ROOM = "tests.chaos.lateness:BusyNode", "tests.chaos.lateness:RoomScanNode"
GMAPPING = {"gmapping": {"kind": "chefbot.nodes.gmapping:GmappingNode", "process": "slam"}}


def busy(**params: bool) -> dict[str, Any]:
    """A node that keeps the mapper's process busy."""
    return {"busy": {"kind": BUSY, "process": "slam", "params": params}}


MAPPERS = {
    "idle": busy(busy=False),
    "a loop that never rests": busy(),
    "gmapping": GMAPPING,
    "gmapping and a thread that never rests": {**GMAPPING, **busy(in_thread=True)},
}


def launch_file(folder: Path, mapper: dict[str, Any], port: Path | None) -> Path:
    """Return the launch for the board at `port`, or for the simulated hotel without a port."""
    nodes = {
        "controller": {"kind": "chefbot.nodes.controller:ControllerNode", "process": "navigation"},
        **mapper,
    }
    launch: dict[str, Any] = {
        "args": {"robot": "chefbot_lidar"},
        "include": ["simulator", "base"],
        "nodes": nodes,
    }
    if port is not None:
        nodes["board"] = {
            "kind": "chefbot.devices.motor_board:MotorBoardDevice",
            "params": {"port": str(port)},
        }
        nodes["lidar"] = {"kind": ROOM}
        launch |= {"clock": "wall", "include": ["base"]}
    for loop, topic in LOOPS.items():
        remap = {"ticks": topic, "offset": f"{loop}_offset"}
        home = "navigation" if loop == "controller" else ""
        nodes[f"{loop}_witness"] = {"kind": WITNESS, "remap": remap, "process": home}
    path = folder / "built.yaml"
    path.write_text(yaml.safe_dump(launch))
    return path


def measure(node: RmwNode, one: LaunchProcess, seconds: float) -> tuple[dict[str, list[float]], float]:
    """Return the delays by loop, and the share of a core that the busy process used."""
    offsets: dict[str, list[float]] = {loop: [] for loop in LOOPS}
    for loop, values in offsets.items():
        node.subscription(f"/{loop}_offset", Float64, lambda message, to=values: to.append(message.data))
    spin = ActionClient(node, "/spin", Spin)
    wait_for(lambda: spin.served and offsets["base"])
    spin.send_goal_async(Spin_Goal(1e3, Duration.of(SETTLE + seconds + 60.0)))
    wait_for(lambda: offsets["controller"])
    time.sleep(SETTLE)
    for values in offsets.values():
        values.clear()
    slam = one.child("slam")
    before, began = cpu_seconds(slam), time.monotonic()
    time.sleep(seconds)
    return offsets, (cpu_seconds(slam) - before) / (time.monotonic() - began)


@contextmanager
def running(
    folder: Path, mapper: dict[str, Any], *, simulated: bool
) -> Iterator[tuple[LaunchProcess, RmwNode]]:
    """Run it until the context is left."""
    board = None if simulated else Emulator(folder, "chefbot_lidar")
    file = launch_file(folder, mapper, None if board is None else board.path)
    one = LaunchProcess(["launch", str(file), "headless:=true"], free_port())
    try:
        with RmwContext(port=one.port, router=False) as wire, RmwNode(wire, "bench") as node:
            yield one, node
    finally:
        one.process.terminate()
        try:
            one.process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            one.process.kill()
        if board is not None:
            board.close()


def main(seconds: float) -> None:
    """Print the table."""
    rows = [(name, False) for name in MAPPERS] + [(name, True) for name in list(MAPPERS)[2:]]
    for name, simulated in rows:
        load = os.getloadavg()[0]
        with (
            tempfile.TemporaryDirectory() as folder,
            running(Path(folder), MAPPERS[name], simulated=simulated) as (one, node),
        ):
            offsets, share = measure(node, one, seconds)
        place = "simulator beside the base" if simulated else "built robot"
        print(f"{place}; mapper's process: {name}")
        print(f"  it uses {share:.2f} of {os.cpu_count()} cores; load before {load:.1f}")
        for loop, values in offsets.items():
            late = late_ms(values)
            p50, p99 = np.percentile(late, [50, 99])
            figures = f"median {p50:5.2f} ms, p99 {p99:6.2f} ms, worst {late.max():6.2f} ms"
            print(f"  {loop:10} {len(late):5} commands, late by {figures}", flush=True)


if __name__ == "__main__":
    os.chdir(ROOT)
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 30.0)
