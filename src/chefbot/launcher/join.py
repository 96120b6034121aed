"""Joining a robot that runs elsewhere: which robot, in whose time, and again after its restart."""

from __future__ import annotations

import queue
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import msgspec

from chefbot.bridge.attach import conflicting_node_names
from chefbot.bridge.local_only import MAIN_NODE_NAME, process_node
from chefbot.design.export.urdf import urdf
from chefbot.errors import UserError
from chefbot.msgs.std_msgs import String
from chefbot.robot.spec import Robot
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import resolve
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext
from chefbot.ros2.tools.common import is_hidden, settle, stop_event
from chefbot.runtime.launch import Launch

POLL_PERIOD = 0.5
"""Period of the checks which robots are there, s."""
SILENT_WAIT = 2.0
"""Time that a robot is looked for before this is logged, s."""
DESCRIPTION_TIMEOUT = 20.0
"""Maximum time to wait for the robot's description, s."""
_ROBOT_NAME = re.compile(r'<robot name="([^"]*)"')
Log = Callable[[str], None]


class JoinedRobot(NamedTuple):
    """The robot that was joined."""

    launch: Launch
    """The launch in the robot's namespace, with its clock set to `simulation` or `wall`."""
    zid: str


def joinable_robots(graph: Graph) -> dict[str, str]:
    """Return the Zenoh session id of each robot on the wire by namespace; it differs after a restart.

    They are found by the node that each launch has for itself.
    """
    return {node.namespace: node.zid for node in graph.nodes() if node.name == MAIN_NODE_NAME}


def joining_node_name(launch: Launch) -> str:
    """Return a unique name for the node that represents a launch which joins a robot."""
    hosts = sorted({entry.host for entry in launch.nodes.values() if entry.host})
    return process_node(re.sub(r"[^A-Za-z0-9_]", "_", hosts[0] if hosts else launch.name))


def join_robot(wire: RmwContext, launch: Launch, robot: Robot, log: Log) -> JoinedRobot | None:
    """Wait for the robot without a time limit; return None if requested to stop meanwhile.

    Raises UserError if there are several robots and none was named, if its nodes have the launch's names, or
    if it is another kind of robot than the launch's.
    """
    namespace = _await_robot(wire, launch, log)
    if namespace is None:
        return None
    settle(wire.graph)
    zid = joinable_robots(wire.graph).get(namespace, "")
    launch = msgspec.structs.replace(launch, args={**launch.args, "namespace": namespace.rstrip("/")})
    _check_names(wire.graph, launch, namespace)
    simulated = _is_simulated(wire.graph, namespace)
    log(f"Joined {_display_name(namespace)}{', in its simulated time' if simulated else ''}.")
    _check_robot(wire, namespace, robot, log)
    return JoinedRobot(msgspec.structs.replace(launch, clock="simulation" if simulated else "wall"), zid)


def _check_names(graph: Graph, launch: Launch, namespace: str) -> None:
    if conflicts := conflicting_node_names(graph, launch):
        raise UserError(
            f"launch {launch.name}: {resolve(conflicts[0], namespace)} runs already, here or on another machine; "
            "stop it there, or leave it out here"
        )


def _await_robot(wire: RmwContext, launch: Launch, log: Log) -> str | None:
    """Wait for the robot and return its namespace; None if requested to stop."""
    requested = str(launch.args["namespace"])
    logged = False
    with stop_event() as stop:
        wire.graph.refresh()
        timeout = SILENT_WAIT
        while not stop.is_set():
            if wire.graph.wait_for(lambda graph: _choose(graph, launch, requested), timeout):
                settle(wire.graph)  # others may be discovered at the same time
                return _choose(wire.graph, launch, requested)
            timeout = POLL_PERIOD
            if not logged:
                log(
                    f"Waiting for {_display_name(requested or '/')} on the wire{_present_robots(wire.graph)}."
                )
                logged = True
    return None


def _choose(graph: Graph, launch: Launch, requested: str) -> str | None:
    """Return the namespace of the requested robot, or None if it is not there."""
    namespaces = sorted(joinable_robots(graph))
    if requested:
        return requested if requested in namespaces else None
    if len(namespaces) > 1:
        raise UserError(
            f"launch {launch.name}: there are several robots, {', '.join(namespaces)}; choose with namespace:=NAME"
        )
    return namespaces[0] if namespaces else None


def _display_name(namespace: str) -> str:
    return "a robot" if namespace == "/" else f"robot {namespace}"


def _present_robots(graph: Graph) -> str:
    namespaces = sorted(joinable_robots(graph))
    others = sorted({node.full_name for node in graph.nodes() if not is_hidden(node.full_name)})
    if namespaces:
        return f"; there is {', '.join(namespaces)}"
    return f"; there are nodes, but of no launch of chefbot: {', '.join(others[:5])}" if others else ""


def _is_simulated(graph: Graph, namespace: str) -> bool:
    """Return whether it publishes /clock (ROS 2's use_sim_time)."""
    clock = graph.topics().get(resolve("clock", namespace))
    return clock is not None and bool(clock.providers)


def _check_robot(wire: RmwContext, namespace: str, robot: Robot, log: Log) -> None:
    """Check that the robot there is the one of this launch, whose dimensions the nodes here use.

    Raises UserError if its name differs; logs a warning if only its dimensions do.
    """
    topic = resolve("robot_description", namespace)
    endpoints = wire.graph.topics().get(topic)
    if endpoints is None or not endpoints.providers:
        return
    remote_urdf = _receive_description(wire, namespace, topic)
    name = found[1] if (found := _ROBOT_NAME.search(remote_urdf)) else "?"
    if name != robot.name:
        raise UserError(
            f"{_display_name(namespace)} is a {name}, not a {robot.name}; set robot:={name}, or give its file"
        )
    if remote_urdf != urdf(robot):
        log(
            f"The {name} there has other dimensions than the one here; use the same robot file on both machines."
        )


def _receive_description(wire: RmwContext, namespace: str, topic: str) -> str:
    received: queue.SimpleQueue[str] = queue.SimpleQueue()
    with RmwNode(wire, "_chefbot_guest", namespace) as node:
        node.subscription(topic, String, lambda message: received.put(message.data), TRANSIENT_LOCAL_QOS)
        try:
            return received.get(timeout=DESCRIPTION_TIMEOUT)
        except queue.Empty:
            raise UserError(
                f"{topic} is offered, but nothing came in {DESCRIPTION_TIMEOUT:.0f} s; is the link too slow?"
            ) from None


@contextmanager
def watch_robot(
    wire: RmwContext, meeting: JoinedRobot, stop: Callable[[], None]
) -> Iterator[threading.Event]:
    """Watch the robot: when it has been restarted, set the yielded event and call `stop`.

    Its odometry, its map and simulated time begin again then, so the state of the nodes here is of no use. A
    link that is lost for a while is not a restart.
    """
    namespace = str(meeting.launch.args["namespace"]) or "/"
    restarted, leaving = threading.Event(), threading.Event()

    def watch() -> None:
        while not leaving.wait(POLL_PERIOD):
            if joinable_robots(wire.graph).get(namespace, meeting.zid) != meeting.zid:
                restarted.set()
                stop()
                return

    thread = threading.Thread(target=watch, name="robot watcher", daemon=True)
    thread.start()
    try:
        yield restarted
    finally:
        leaving.set()
        thread.join()
