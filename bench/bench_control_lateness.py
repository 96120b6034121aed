"""How late the wheels' and the controller's loops are while SLAM uses a whole core, in processes, at real time.

A built robot's launch on the emulated board: base, odometry and the board's driver in the launch's own process, the
controller in a second one, and a third that is as busy as a mapper can be: it never rests. A witness beside the
base (20 Hz) and another beside the controller (10 Hz, while it turns the robot) tell when each command was really
said; the most punctual of a run is what counts as in time.

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

import numpy as np
import yaml

from chefbot.commands.demo_processes import cpu_seconds
from chefbot.msgs.builtin_interfaces import Duration
from chefbot.msgs.nav2_msgs import Spin, Spin_Goal
from chefbot.msgs.std_msgs import Float64
from chefbot.wire.action_client import ActionClient
from chefbot.wire.node import WireNode
from chefbot.wire.session import Wire

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.chaos.lateness import late_ms  # noqa: E402
from tests.chaos.launched import Launched, free_port, wait_for  # noqa: E402
from tests.devices.emulated import Emulator  # noqa: E402

WITNESS = "tests.chaos.lateness:LatenessNode"
LOOPS = {"base": "cmd_vel", "controller": "cmd_vel_nav"}
SETTLE = 5.0
"""Seconds after the first command in which kernels are still loaded."""


def launch_file(folder: Path, port: Path, busy: bool) -> Path:
    """For the board at `port`."""
    nodes = {
        "board": {"kind": "chefbot.devices.board:BoardDevice", "params": {"port": str(port)}},
        "controller": {"kind": "chefbot.nodes.controller:ControllerNode", "process": "navigation"},
        "slam": {"kind": "tests.chaos.lateness:BusyNode", "process": "slam", "params": {"busy": busy}},
    }
    for loop, topic in LOOPS.items():
        remap = {"ticks": topic, "offset": f"{loop}_offset"}
        home = "navigation" if loop == "controller" else ""
        nodes[f"{loop}_witness"] = {"kind": WITNESS, "remap": remap, "process": home}
    path = folder / "built.yaml"
    path.write_text(yaml.safe_dump({"clock": "wall", "include": ["base"], "nodes": nodes}))
    return path


def measure(node: WireNode, one: Launched, seconds: float) -> tuple[dict[str, list[float]], float]:
    """Offsets by loop, and the share of a core that the busy process used."""
    offsets: dict[str, list[float]] = {loop: [] for loop in LOOPS}
    for loop, said in offsets.items():
        node.subscription(f"/{loop}_offset", Float64, lambda told, to=said: to.append(told.data))
    spin = ActionClient(node, "/spin", Spin)
    wait_for(lambda: spin.served and offsets["base"])
    spin.send(Spin_Goal(1e3, Duration.of(SETTLE + seconds + 60.0)))
    wait_for(lambda: offsets["controller"])
    time.sleep(SETTLE)
    for said in offsets.values():
        said.clear()
    slam = one.child("slam")
    before, began = cpu_seconds(slam), time.monotonic()
    time.sleep(seconds)
    return offsets, (cpu_seconds(slam) - before) / (time.monotonic() - began)


@contextmanager
def built(folder: Path, busy: bool) -> Iterator[tuple[Launched, WireNode]]:
    """It runs until this is left."""
    board = Emulator(folder)
    one = Launched(["launch", str(launch_file(folder, board.path, busy)), "headless:=true"], free_port())
    try:
        with Wire(port=one.port, router=False) as wire, WireNode(wire, "bench") as node:
            yield one, node
    finally:
        one.process.terminate()
        try:
            one.process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            one.process.kill()
        board.close()


def main(seconds: float) -> None:
    """Print the table."""
    for busy in (False, True):
        load = os.getloadavg()[0]
        with tempfile.TemporaryDirectory() as folder, built(Path(folder), busy) as (one, node):
            offsets, share = measure(node, one, seconds)
        print(f"SLAM's process uses {share:.2f} of {os.cpu_count()} cores; load before {load:.1f}")
        for loop, said in offsets.items():
            late = late_ms(said)
            p50, p99 = np.percentile(late, [50, 99])
            figures = f"median {p50:5.2f} ms, p99 {p99:6.2f} ms, worst {late.max():6.2f} ms"
            print(f"  {loop:10} {len(late):5} commands, late by {figures}")


if __name__ == "__main__":
    os.chdir(ROOT)
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 30.0)
