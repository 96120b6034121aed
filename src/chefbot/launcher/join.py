"""A launch that joins a robot which runs elsewhere: which one, in whose time, and again when it starts anew."""

from __future__ import annotations

import queue
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import msgspec

from chefbot.bridge.attach import same_names
from chefbot.bridge.local_only import LEADER, process_node
from chefbot.design.export.urdf import urdf
from chefbot.errors import UserError
from chefbot.msgs.std_msgs import String
from chefbot.robot.spec import Robot
from chefbot.ros2.rmw.graph import Graph
from chefbot.ros2.rmw.names import resolve
from chefbot.ros2.rmw.node import WireNode
from chefbot.ros2.rmw.qos import LATCHED
from chefbot.ros2.rmw.session import Wire
from chefbot.ros2.tools.common import hidden, settle, stopping
from chefbot.runtime.launch import Launch

LOOK_PERIOD = 0.5
"""Seconds between two looks at who is there."""
QUIET_WAIT = 2.0
"""Seconds that a robot is looked for without a word."""
PATIENCE = 20.0
"""Seconds to wait for the first word of a robot that is there."""
_NAME = re.compile(r'<robot name="([^"]*)"')
Tell = Callable[[str], None]


class Robots(NamedTuple):
    """Robots on the wire that may be joined, by namespace; `zid` tells one start of a robot from the next."""

    zids: dict[str, str]

    @staticmethod
    def of(graph: Graph) -> Robots:
        """By the node that each launch has for itself."""
        return Robots({one.namespace: one.zid for one in graph.nodes() if one.name == LEADER})


class Meeting(NamedTuple):
    """Which robot was found."""

    launch: Launch
    """In the robot's namespace, its clock `simulation` or `wall`."""
    zid: str


def guest_name(launch: Launch) -> str:
    """What the node is called that speaks for a launch that joins: beside the robot's own, and no other's."""
    hosts = sorted({entry.host for entry in launch.nodes.values() if entry.host})
    return process_node(re.sub(r"[^A-Za-z0-9_]", "_", hosts[0] if hosts else launch.name))


def meet(wire: Wire, launch: Launch, robot: Robot, tell: Tell) -> Meeting | None:
    """Wait for the robot, for ever; None if told to stop meanwhile.

    UserError where there are several and none was named, where its nodes have our names, or where it is another
    kind of robot than the launch says.
    """
    space = _await_robot(wire, launch, tell)
    if space is None:
        return None
    settle(wire.graph)
    zid = Robots.of(wire.graph).zids.get(space, "")
    launch = msgspec.structs.replace(launch, args={**launch.args, "namespace": space.rstrip("/")})
    if rivals := same_names(wire.graph, launch):
        raise UserError(
            f"launch {launch.name}: {resolve(rivals[0], space)} runs already, here or on another machine; "
            "stop it there, or leave it out here"
        )
    simulated = _is_simulated(wire.graph, space)
    tell(f"Joined {_spoken(space)}{', in its simulated time' if simulated else ''}.")
    _check_robot(wire, space, robot, tell)
    return Meeting(msgspec.structs.replace(launch, clock="simulation" if simulated else "wall"), zid)


def _await_robot(wire: Wire, launch: Launch, tell: Tell) -> str | None:
    """Its namespace; None if told to stop."""
    wanted = str(launch.args["namespace"])
    told = False
    with stopping() as stop:
        wire.graph.refresh()
        patience = QUIET_WAIT
        while not stop.is_set():
            if wire.graph.wait_for(lambda graph: _choose(graph, launch, wanted), patience):
                settle(wire.graph)  # others may come in the same breath
                return _choose(wire.graph, launch, wanted)
            patience = LOOK_PERIOD
            if not told:
                tell(f"Waiting for {_spoken(wanted or '/')} on the wire{_seen(wire.graph)}.")
                told = True
    return None


def _choose(graph: Graph, launch: Launch, wanted: str) -> str | None:
    """The namespace of the robot that is meant, None if it is not there."""
    spaces = sorted(Robots.of(graph).zids)
    if wanted:
        return wanted if wanted in spaces else None
    if len(spaces) > 1:
        raise UserError(
            f"launch {launch.name}: there are several robots, {', '.join(spaces)}; say namespace:=NAME for one"
        )
    return spaces[0] if spaces else None


def _spoken(space: str) -> str:
    return "a robot" if space == "/" else f"robot {space}"


def _seen(graph: Graph) -> str:
    spaces = sorted(Robots.of(graph).zids)
    others = sorted({one.full_name for one in graph.nodes() if not hidden(one.full_name)})
    if spaces:
        return f"; there is {', '.join(spaces)}"
    return f"; there are nodes, but of no launch of chefbot: {', '.join(others[:5])}" if others else ""


def _is_simulated(graph: Graph, space: str) -> bool:
    """Whether it tells /clock (ROS 2's use_sim_time)."""
    clock = graph.topics().get(resolve("clock", space))
    return clock is not None and bool(clock.givers)


def _check_robot(wire: Wire, space: str, robot: Robot, tell: Tell) -> None:
    """What is thought here goes by this robot's numbers: they must be those of the robot there."""
    topic = resolve("robot_description", space)
    named = wire.graph.topics().get(topic)
    if named is None or not named.givers:
        return
    told: queue.SimpleQueue[str] = queue.SimpleQueue()
    with WireNode(wire, "_chefbot_guest", space) as node:
        node.subscription(topic, String, lambda message: told.put(message.data), LATCHED)
        try:
            there = told.get(timeout=PATIENCE)
        except queue.Empty:
            raise UserError(
                f"{topic} is offered, but nothing came in {PATIENCE:.0f} s; is the link too slow?"
            ) from None
    name = found[1] if (found := _NAME.search(there)) else "?"
    if name != robot.name:
        raise UserError(
            f"{_spoken(space)} is a {name}, not a {robot.name}; say robot:={name}, or give its file"
        )
    if there != urdf(robot):
        tell(
            f"The {name} there has other measures than the one here; use the same robot file on both machines."
        )


@contextmanager
def watching(wire: Wire, meeting: Meeting, stop: Callable[[], None]) -> Iterator[threading.Event]:
    """Calls `stop` when the robot has been started anew, and sets the event.

    Its odometry and its map begin anew then, and so does simulated time: what was thought here is of no use. A
    link that is cut for a while is no new start.
    """
    space = str(meeting.launch.args["namespace"]) or "/"
    anew, left = threading.Event(), threading.Event()

    def watch() -> None:
        while not left.wait(LOOK_PERIOD):
            if Robots.of(wire.graph).zids.get(space, meeting.zid) != meeting.zid:
                anew.set()
                stop()
                return

    thread = threading.Thread(target=watch, name="robot watcher", daemon=True)
    thread.start()
    try:
        yield anew
    finally:
        left.set()
        thread.join()
