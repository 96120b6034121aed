"""How late the wheels' and the controller's loops are while SLAM uses a whole core, in processes, at real time.

The lidar robot explores the room. Its mapper runs in a process of its own that a busy node keeps from ever resting.
A witness in the process of the base (20 Hz) and another in that of the controller (10 Hz) tell when each command was
really said; the most punctual of a run is what counts as in time. The base's process simulates world and board, too.

Run: python bench/bench_control_lateness.py [SECONDS]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

from chefbot.commands.demo_processes import cpu_seconds
from chefbot.msgs.std_msgs import Float64
from chefbot.wire.node import WireNode
from chefbot.wire.session import Wire

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.lateness import late_ms  # noqa: E402
from tests.chaos.launched import Launched, free_port, wait_for  # noqa: E402

WITNESS = "tests.chaos.lateness:LatenessNode"
NODES = {
    "gmapping": {"kind": "chefbot.nodes.gmapping:GmappingNode", "process": "slam"},
    "busy": {"kind": "tests.chaos.lateness:BusyNode", "process": "slam"},
    "planner": {"kind": "chefbot.nodes.planner:PlannerNode", "process": "navigation"},
    "controller": {"kind": "chefbot.nodes.controller:ControllerNode", "process": "navigation"},
    "navigator": {"kind": "chefbot.nodes.navigator:NavigatorNode", "process": "navigation"},
    "explorer": {"kind": "chefbot.nodes.explorer:ExplorerNode", "process": "navigation"},
    "base_witness": {"kind": WITNESS, "remap": {"ticks": "cmd_vel", "offset": "base_offset"}},
    "controller_witness": {
        "kind": WITNESS,
        "remap": {"ticks": "cmd_vel_nav", "offset": "controller_offset"},
        "process": "navigation",
    },
}
LAUNCH = {
    "include": ["simulator", "base", "navigation"],
    "args": {"world": "room", "robot": "chefbot_lidar", "people": 0},
    "nodes": NODES,
}
SETTLE = 5.0
"""Seconds after the first command in which kernels are still loaded."""


def measure(node: WireNode, one: Launched, seconds: float) -> tuple[dict[str, list[float]], float]:
    """Offsets by loop, and the share of a core that the mapper's process used."""
    offsets: dict[str, list[float]] = {"base": [], "controller": []}
    for name, list_ in offsets.items():
        node.subscription(f"/{name}_offset", Float64, lambda said, to=list_: to.append(said.data))
    wait_for(lambda: all(offsets.values()))
    time.sleep(SETTLE)
    for list_ in offsets.values():
        list_.clear()
    slam = one.child("slam")
    before, began = cpu_seconds(slam), time.monotonic()
    time.sleep(seconds)
    return offsets, (cpu_seconds(slam) - before) / (time.monotonic() - began)


def main(seconds: float) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "busy.yaml"
        path.write_text(yaml.safe_dump(LAUNCH))
        one = Launched(["launch", str(path), "headless:=true"], free_port())
        try:
            with Wire(port=one.port, router=False) as wire, WireNode(wire, "bench") as node:
                load = os.getloadavg()[0]
                offsets, share = measure(node, one, seconds)
        finally:
            one.process.terminate()
            try:
                one.process.communicate(timeout=10.0)
            except subprocess.TimeoutExpired:
                one.process.kill()
    print(f"{os.cpu_count()} cores, load before {load:.1f}; SLAM's process used {share:.2f} cores")
    for name, list_ in offsets.items():
        late = late_ms(list_)
        p50, p99 = np.percentile(late, [50, 99])
        print(
            f"{name:10} {len(late):5} commands, late by median {p50:5.2f} ms, p99 {p99:6.2f} ms, "
            f"worst {late.max():6.2f} ms"
        )


if __name__ == "__main__":
    os.chdir(ROOT)
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 30.0)
