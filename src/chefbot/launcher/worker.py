"""One process of a launch: `python -m chefbot.launcher.worker`, started by the launch's supervisor.

Its nodes meet the others over the wire. It ends when its standard input does, so it never outlives its launch.
"""

from __future__ import annotations

import ctypes
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection
from pathlib import Path

import msgspec
from rich.console import Console

from chefbot.bridge.bridge import Bridge
from chefbot.bridge.inbox import WIRE
from chefbot.bridge.local_only import process_node
from chefbot.bridge.ports import latched_topics
from chefbot.bridge.robot_time import RobotTime
from chefbot.bridge.sim_time_sync import Follower
from chefbot.errors import UserError
from chefbot.kernels.groups import GROUPS, groups_of
from chefbot.launcher.session import announce, keep_going, show_fault, show_remarks
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.session import Wire
from chefbot.runtime.clock import WallClock
from chefbot.runtime.launch import Launch, node_class, split
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import LAST_WORDS
from chefbot.runtime.node_container import System
from chefbot.signals import stop_on_signals
from chefbot.supervision.heartbeat import Heart
from chefbot.supervision.worker_process import Order, Preparation

PR_SET_PDEATHSIG = 1
"""prctl(2), linux/prctl.h: a signal when the parent dies."""
GRACE = 1.5
"""Seconds between being told to end and being gone."""


def main() -> int:
    """Exit code 2 after a sentence where the input is at fault."""
    sys.setswitchinterval(1e-4)
    _be_woken_by_the_end_of_the_launch()
    told = Input()
    preparation = msgspec.json.decode(told.line(), type=Preparation)
    _load(preparation)
    order = msgspec.json.decode(told.line(), type=Order)
    _take_name(order.process)
    try:
        if not preparation.spare:
            _load_kernels({entry.kind for entry in split(order.launch)[1][order.process].nodes.values()})
        run(order, told)
    except UserError as error:
        Console(stderr=True).print(f"process {order.process}: {error}", markup=False)
        return 2
    return 0


def run(order: Order, told: Input) -> None:
    """Until the input ends."""
    own = split(order.launch)[1][order.process]
    robot = load_robot(str(own.args["robot"]))
    with Wire(order.domain, port=order.port, router=False) as wire:
        name = process_node(order.process)
        space = str(own.args["namespace"]) or "/"
        loop = _loop(wire, order.process, own)
        system = System(loop, robot, int(own.args["seed"]))
        system.isolate(show_fault)
        simulated = own.clock == "simulation"
        bridge = Bridge(system, wire, space, simulated=simulated, leads=False, own=name)
        loop.tap(show_remarks)
        loop.post(lambda: _begin(system, bridge, order, own))
        told.stop = loop.stop
        keep_going(loop)
        Heart(loop, sys.stdin.fileno())
        try:
            with stop_on_signals(loop.stop):
                loop.run()
        finally:
            system.stop()
            bridge.close()


def _be_woken_by_the_end_of_the_launch() -> None:
    """One that is stopped sees no end of its input, and would stay for ever; where the system can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGCONT))


def _load(preparation: Preparation) -> None:
    """Whoever it is going to be: most of a start's time goes here."""
    sys.path.append(preparation.folder)
    for kind in preparation.kinds:
        node_class(kind, "child process")
    if preparation.spare:
        _load_kernels(preparation.kinds)


def _load_kernels(kinds: Collection[str]) -> None:
    """They are compiled already, by the launch; loading them takes seconds of a busy computer, and scans come."""
    for group in groups_of(kinds):
        GROUPS[group]()


def _take_name(process: str) -> None:
    """For those who look at a list of processes, where the system has that."""
    name = Path("/proc/self/comm")
    if name.exists():
        name.write_text(process)


def _begin(system: System, bridge: Bridge, order: Order, own: Launch) -> None:
    """Nodes, and what they have to know of their life before: then only what others say comes in."""
    system.launch(own)
    for word in order.last_words:
        system.loop.publish(LAST_WORDS + word.topic, word.message(), WIRE, from_device=True)
    bridge.represent(system.nodes.values(), latched_topics(order.launch))
    announce(Console(highlight=False), system.nodes.values())


def _loop(wire: Wire, process: str, own: Launch) -> Loop:
    """In the launch's time; where that is simulated it says how far it has come."""
    if own.clock != "simulation":
        return Loop(WallClock(), time.time_ns())
    node = WireNode(wire, f"{process_node(process)}_clock", str(own.args["namespace"]) or "/")
    robot_time = RobotTime(node, Follower(node, process).tell)
    loop = Loop(robot_time.clock, robot_time.start_ns)
    robot_time.drive(loop)
    return loop


class Input:
    """Two lines, then silence; when it ends, so does the process, whatever it is doing: its launch is no more.

    `stop` ends what runs in order, once something runs.
    """

    def __init__(self) -> None:
        self.stop: Callable[[], None] | None = None
        self._lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="input", daemon=True).start()

    def line(self) -> bytes:
        """The next one; does not return where there is none."""
        return self._lines.get()

    def _read(self) -> None:
        rest = b""
        while data := _received():
            *lines, rest = (rest + data).split(b"\n")
            for line in lines:
                self._lines.put(line)
        if self.stop is not None:
            self.stop()
            time.sleep(GRACE)
        os._exit(0 if self.stop is None else 1)  # nothing has begun yet, or somebody holds the loop up


def _received() -> bytes:
    """More of the input; nothing at its end. Not by a buffer, whose lock would hold up the end."""
    try:
        return os.read(sys.stdin.fileno(), 1 << 16)
    except ConnectionResetError:  # the launch died with signs of life unread
        return b""


if __name__ == "__main__":
    sys.exit(main())
