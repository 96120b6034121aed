"""A worker process of a launch: `python -m chefbot.launcher.worker`, started by the launch's supervisor.

Its nodes communicate with the others over the wire. It exits when its standard input ends, so it never
outlives its launch.
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
from chefbot.bridge.inbox import WIRE_PUBLISHER
from chefbot.bridge.local_only import process_node
from chefbot.bridge.ports import launch_ports
from chefbot.bridge.robot_time import RobotTime
from chefbot.bridge.sim_time_sync import ProgressPublisher
from chefbot.errors import ChefbotError
from chefbot.kernels.groups import GROUPS, groups_of
from chefbot.launcher.session import (
    announce,
    freeze_loaded_objects,
    keep_loop_alive,
    print_fault,
    print_notices,
)
from chefbot.msgs.std_msgs import String
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.clock import WallClock
from chefbot.runtime.launch import Launch, node_class, split_by_process
from chefbot.runtime.loop import Loop
from chefbot.runtime.node import RESTORED_PREFIX
from chefbot.runtime.node_container import CONFIGURATION_TOPIC, NodeContainer
from chefbot.signals import stop_on_signals
from chefbot.supervision.heartbeat import HeartbeatSender
from chefbot.supervision.worker_process import EXIT_TIMEOUT, PreloadSpec, WorkerSpec

PR_SET_PDEATHSIG = 1
"""prctl(2), linux/prctl.h: send this process a signal when its parent dies."""


def main() -> int:
    """Run the worker; returns exit code 2 after a message if the input is at fault."""
    sys.setswitchinterval(1e-4)
    _request_signal_at_parent_death()
    stdin = LaunchInput()
    preparation = msgspec.json.decode(stdin.line(), type=PreloadSpec)
    _preload(preparation)
    order = msgspec.json.decode(stdin.line(), type=WorkerSpec)
    _set_process_name(order.process)
    try:
        if not preparation.spare:
            _load_kernels(
                {entry.kind for entry in split_by_process(order.launch)[1][order.process].nodes.values()}
            )
        run(order, stdin)
    except ChefbotError as error:
        Console(stderr=True).print(f"process {order.process}: {error}", markup=False)
        return 2
    return 0


def run(order: WorkerSpec, stdin: LaunchInput) -> None:
    """Run the nodes of the assigned process until the input ends."""
    launch = split_by_process(order.launch)[1][order.process]
    robot = load_robot(str(launch.args["robot"]))
    with RmwContext(order.domain, port=order.port, router=False) as wire:
        name = process_node(order.process)
        namespace = str(launch.args["namespace"]) or "/"
        loop = _loop(wire, order.process, launch)
        system = NodeContainer(loop, robot, int(launch.args["seed"]))
        system.isolate_faults(print_fault)
        simulated = launch.clock == "simulation"
        bridge = Bridge(system, wire, namespace, simulated=simulated, publishes_clock=False, node_name=name)
        loop.add_observer(print_notices)
        loop.post(lambda: _start_nodes(system, bridge, order, launch))
        stdin.stop = loop.stop
        keep_loop_alive(loop)
        HeartbeatSender(loop, sys.stdin.fileno())
        try:
            with stop_on_signals(loop.stop):
                loop.run()
        finally:
            system.stop()
            bridge.close()


def _request_signal_at_parent_death() -> None:
    """Request SIGCONT at the parent's death (Linux only).

    A stopped process does not see the end of its input and would otherwise stay forever.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGCONT))


def _preload(preparation: PreloadSpec) -> None:
    """Import what any process of the launch needs: most of the start-up time goes here."""
    sys.path.append(preparation.folder)
    for kind in preparation.kinds:
        node_class(kind, "child process")
    if preparation.spare:
        _load_kernels(preparation.kinds)


def _load_kernels(kinds: Collection[str]) -> None:
    """Load the compiled kernels now: later this would take seconds while scans are received."""
    for group in groups_of(kinds):
        GROUPS[group]()


def _set_process_name(process: str) -> None:
    """Set the name in the system's process list (Linux only)."""
    name = Path("/proc/self/comm")
    if name.exists():
        name.write_text(process)


def _start_nodes(system: NodeContainer, bridge: Bridge, order: WorkerSpec, launch: Launch) -> None:
    """Start the nodes and restore their state after a restart, before messages of others are received."""
    system.launch(launch)
    whole = String(order.launch.to_json())
    system.loop.publish(CONFIGURATION_TOPIC, whole, "chefbot", from_device=True, latched=True)
    for state in order.restored_messages:
        system.loop.publish(
            RESTORED_PREFIX + state.topic, state.deserialize(), WIRE_PUBLISHER, from_device=True
        )
    bridge.represent(system.nodes.values(), launch_ports(order.launch))
    freeze_loaded_objects()
    announce(Console(highlight=False), system.nodes.values())


def _loop(wire: RmwContext, process: str, launch: Launch) -> Loop:
    """Return a loop in the launch's time; it publishes its progress if that time is simulated."""
    if launch.clock != "simulation":
        return Loop(WallClock(), time.time_ns())
    node = RmwNode(wire, f"{process_node(process)}_clock", str(launch.args["namespace"]) or "/")
    robot_time = RobotTime(node, ProgressPublisher(node, process).publish)
    loop = Loop(robot_time.clock, robot_time.start_ns)
    robot_time.attach(loop)
    return loop


class LaunchInput:
    """Standard input of the worker: two lines, and its end.

    When it ends, the launch has exited and so does this process; `stop` is called first if something runs by
    then.
    """

    def __init__(self) -> None:
        self.stop: Callable[[], None] | None = None
        self._lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        threading.Thread(target=self._read, name="input", daemon=True).start()

    def line(self) -> bytes:
        """Return the next line, and block until there is one."""
        return self._lines.get()

    def _read(self) -> None:
        incomplete = b""
        while data := _read_stdin():
            *lines, incomplete = (incomplete + data).split(b"\n")
            for line in lines:
                self._lines.put(line)
        if self.stop is not None:
            self.stop()
            time.sleep(EXIT_TIMEOUT)
        os._exit(0 if self.stop is None else 1)  # nothing has started yet, or a callback blocks the loop


def _read_stdin() -> bytes:
    """Read more of the input, b'' at its end; unbuffered, as a buffer's lock would delay the exit."""
    try:
        return os.read(sys.stdin.fileno(), 1 << 16)
    except ConnectionResetError:  # the launch process died with unread heartbeats
        return b""


if __name__ == "__main__":
    sys.exit(main())
