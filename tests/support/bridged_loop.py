"""Runs a node container with a bridge in this process, and a ROS 2 node on the same network."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from chefbot.bridge.bridge import Bridge
from chefbot.msgs.idl.service import Service
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.publisher import Publisher
from chefbot.ros2.rmw.service import Client
from chefbot.ros2.rmw.session import RmwContext
from chefbot.runtime.clock import PacedClock
from chefbot.runtime.launch import Launch, NodeEntry
from chefbot.runtime.loop import Loop
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorder import Recorder
from tests.support.waiting import wait_for

NODES = {
    "counter": "Counter",
    "doubler": "Doubler",
    "cook": "Cook",
    "guest": "Guest",
    "wheels": "Wheels",
    "base": "Base",
    "map_server": "MapServer",
    "map_user": "MapUser",
}


def launch_of(names: tuple[str, ...]) -> Launch:
    """Return a launch with the named nodes and one that publishes all the time, as a device does."""
    entries = {name: NodeEntry(kind=f"tests.runtime.toys:{NODES[name]}") for name in names}
    entries["metronome"] = NodeEntry(kind="tests.runtime.toys:Counter", remap={"count": "tick"})
    return Launch(name="test", description="", args={}, nodes=entries)


class BridgedLoop:
    """A loop in a thread at a real-time factor of 1 with a bridge, and a ROS 2 node that observes it."""

    def __init__(self, port: int, names: tuple[str, ...], record: Path | None) -> None:
        self.system = NodeContainer(Loop(PacedClock(1.0)), load_robot("chefbot"), 5)
        self.recorder = Recorder(record, self.system.robot, 5) if record else None
        if self.recorder:
            self.system.loop.add_observer(self.recorder)
        self.wire = RmwContext(port=port)
        self.bridge = Bridge(self.system, self.wire, simulated=True)
        self.outside = RmwContext(port=port, router=False)
        self.outsider = RmwNode(self.outside, "outsider")
        self.system.launch(launch_of(names))
        self.bridge.represent(self.system.nodes.values())
        assert self.bridge.flush()
        self.thread = threading.Thread(target=self.system.loop.run, args=(60 * 10**9,))
        self.thread.start()

    def stop(self) -> None:
        self.system.loop.stop()
        self.thread.join()
        if self.recorder:
            self.recorder.close()
        self.system.stop()
        self.outsider.close()
        self.outside.close()
        self.bridge.close()
        self.wire.close()

    def wait_until_joined(self, publisher: Publisher[Any], node: str, topic: str) -> None:
        """Wait until a publisher outside has subscribers, and the topic of a node has some outside."""
        proxies = self.bridge._proxies.publishers
        wait_for(lambda: publisher.has_subscribers and proxies[node, topic].has_subscribers)

    def subscribe(self, topic: str, kind: type, *qos: object) -> queue.Queue:
        received: queue.Queue = queue.Queue()
        self.outsider.subscription(topic, kind, received.put, *qos)
        return received


def ready_client(node: RmwNode, name: str, service: Service[Any, Any]) -> Client[Any, Any]:
    """Return a client of a service once it has found the server; a call before that has no response."""
    client: Client[Any, Any] = node.client(name, service)
    wait_for(lambda: client.server_is_ready)
    return client


@contextmanager
def running(port: int, *names: str, record: Path | None = None) -> Iterator[BridgedLoop]:
    bridged = BridgedLoop(port, names, record)
    try:
        yield bridged
    finally:
        bridged.stop()
