"""Messages between two processes over the wire: half of the round trip; CPU time of both sides per message.

A child process echoes. Beside each, the same bytes through Zenoh alone, in the same sessions, which includes the
wake-up time of the machine. The 16 MB map is sent one way, to a late-joining subscriber.
"""

from __future__ import annotations

import os
import queue
import socket
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
import zenoh

from chefbot.msgs.geometry_msgs import Twist
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import MapMetaData, OccupancyGrid
from chefbot.msgs.sensor_msgs import Image, LaserScan
from chefbot.msgs.std_msgs import Float64, Header
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.ros2.rmw.session import RmwContext

KINDS: tuple[type[Message], ...] = (Twist, LaserScan, Image)
SIDE = 4000
ROUNDS = 9
WARMING = 10
"""Warm-up messages of a round."""


def child(port: int) -> None:
    """Echo every message; send the processor time on request."""
    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "echo") as node:
        for kind in KINDS:
            back = node.publisher(f"back/{kind.__name__}", kind)
            node.subscription(f"there/{kind.__name__}", kind, back.publish)
        bare = wire.session.declare_publisher("bare/back", congestion_control=zenoh.CongestionControl.DROP)
        listen(wire.session, "bare/there", bare.put)
        cells = np.random.default_rng(1).integers(-1, 100, SIDE * SIDE).astype(np.int8)
        info = MapMetaData(resolution=0.05, width=SIDE, height=SIDE)
        node.publisher("map", OccupancyGrid, TRANSIENT_LOCAL_QOS).publish(
            OccupancyGrid(Header(), info, cells)
        )
        used = node.publisher("used", Float64)
        node.subscription("request", Float64, lambda _: used.publish(Float64(time.process_time())))
        sys.stdin.read()


def message_of(kind: type[Message]) -> Message:
    """Return a message of typical size."""
    if kind is Twist:
        return Twist.of(0.3, 0.1)
    if kind is LaserScan:
        return LaserScan(
            Header.of(1, "laser"), -1.0, 1.0, 0.003, 0.0, 0.1, 0.1, 8.0, np.ones(640, np.float32)
        )
    return Image.of(Header.of(1, "camera"), "rgb8", np.zeros((480, 640, 3), np.uint8))


def wait_for(condition) -> None:
    """Wait until the condition holds."""
    until = time.monotonic() + 10
    while not condition():
        if time.monotonic() > until:
            raise SystemExit("the other process does not answer")
        time.sleep(0.01)


def listen(session: zenoh.Session, key: str, take: Callable[[bytes], None]) -> zenoh.Subscriber[None]:
    """Subscribe to the bytes of a key, without ROS 2's protocol."""
    handler = zenoh.handlers.Callback(lambda sample: take(sample.payload.to_bytes()), indirect=False)
    return session.declare_subscriber(key, handler)


class Pair:
    """The endpoints for one type, and those of the same bytes through Zenoh alone."""

    def __init__(self, wire: RmwContext, kind: type[Message]) -> None:
        self.got: queue.SimpleQueue[object] = queue.SimpleQueue()
        self.lost = 0
        self._used: queue.SimpleQueue[Float64] = queue.SimpleQueue()
        self._node = RmwNode(wire, f"bench_{kind.__name__}")
        self._node.subscription(f"back/{kind.__name__}", kind, self.got.put)
        self._node.subscription("used", Float64, self._used.put)
        self._there = self._node.publisher(f"there/{kind.__name__}", kind)
        self._request = self._node.publisher("request", Float64)
        self._bare_back = listen(wire.session, "bare/back", self.got.put)
        drop = zenoh.CongestionControl.DROP
        self._bare = wire.session.declare_publisher("bare/there", congestion_control=drop)
        wait_for(
            lambda: (
                self._there.has_subscribers
                and self._request.has_subscribers
                and self._bare.matching_status.matching
            )
        )
        self._message = message_of(kind)
        self._bytes = self._message.to_cdr()

    def send(self) -> None:
        """Send a message over the wire."""
        self._there.publish(self._message)

    def send_bare(self) -> None:
        """Send its bytes through Zenoh alone."""
        self._bare.put(self._bytes)

    def answered(self, send: Callable[[], None]) -> bool:
        """Return whether the message came back; count a lost one."""
        while not self.got.empty():
            self.got.get()  # too late
        send()
        try:
            self.got.get(timeout=1)
        except queue.Empty:
            self.lost += 1
        else:
            return True
        return False

    def used(self) -> float:
        """Return the processor time of both sides so far, s."""
        self._request.publish(Float64())
        return self._used.get(timeout=10).data + time.process_time()

    def close(self) -> None:
        """Close the endpoints."""
        self._node.close()
        self._bare_back.undeclare()
        self._bare.undeclare()


def round_trips(pair: Pair, send: Callable[[], None], count: int, hz: float) -> tuple[float, float, float]:
    """Return half of the round trip, p50 and p99, us, and the processor time of one way, us."""
    times: list[float] = []
    for index in range(count + WARMING):
        if index == WARMING:
            before = pair.used()
        began = time.perf_counter_ns()
        while not pair.answered(send):  # a crowded machine drops pictures
            began = time.perf_counter_ns()
        took = time.perf_counter_ns() - began
        times.append(took / 2e3)
        time.sleep(max(0.0, 1.0 / hz - took / 1e9))
    cpu = (pair.used() - before) / count / 2 * 1e6
    p50, p99 = np.percentile(times[WARMING:], [50, 99])
    return float(p50), float(p99), cpu


def show(wire: RmwContext, kind: type[Message], count: int, hz: float) -> None:
    """Measure the wire and Zenoh alone in turns, as the machine's speed varies; print medians and differences."""
    pair = Pair(wire, kind)
    sends = {kind.__name__: pair.send, "  Zenoh alone": pair.send_bare}
    rounds = {name: np.zeros((ROUNDS, 3)) for name in sends}
    for number in range(ROUNDS):
        for name, send in sends.items():
            rounds[name][number] = round_trips(pair, send, count // ROUNDS, hz)
    for name, (p50, p99, cpu) in ((name, np.median(one, axis=0)) for name, one in rounds.items()):
        print(f"{name:14} p50 {p50:5.0f} us  p99 {p99:5.0f} us  CPU of both sides {cpu:5.0f} us")
    ours, bare = rounds.values()
    p50, _, cpu = np.median(ours - bare, axis=0)
    print(f"{'  above it':14} p50 {p50:5.0f} us                CPU of both sides {cpu:5.0f} us")
    if pair.lost:
        print(f"  of {kind.__name__} {pair.lost} were lost")
    pair.close()


def late_joiner(port: int) -> float:
    """Return the ms from the request of the 16 MB map to its arrival, in an open session."""
    with RmwContext(port=port, router=False) as wire, RmwNode(wire, "late") as node:
        wait_for(lambda: wire.connected)
        wire.graph.refresh()
        got: queue.SimpleQueue[OccupancyGrid] = queue.SimpleQueue()
        began = time.perf_counter()
        node.subscription("map", OccupancyGrid, got.put, TRANSIENT_LOCAL_QOS)
        assert got.get(timeout=10).data.size == SIDE * SIDE
        return (time.perf_counter() - began) * 1e3


def opening(port: int) -> float:
    """Return the ms to open the wire."""
    began = time.perf_counter()
    with RmwContext(port=port):
        return (time.perf_counter() - began) * 1e3


def main() -> None:
    """Print the table."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    openings = [opening(port) for _ in range(10)]
    print(f"opening the wire: median {np.median(openings):.1f} ms, worst {max(openings):.1f} ms")
    with RmwContext(port=port) as wire:
        command = [sys.executable, __file__, str(port)]
        process = subprocess.Popen(command, stdin=subprocess.PIPE)
        wait_for(lambda: "/map" in wire.graph.topics())
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
        for kind, count, hz in ((Twist, 1000, 500.0), (LaserScan, 500, 200.0), (Image, 150, 30.0)):
            show(wire, kind, count, hz)
        times = [late_joiner(port) for _ in range(5)]
        print(
            f"map of 16 MB to a late-joining subscriber: median {np.median(times):.0f} ms, worst {max(times):.0f} ms"
        )
        process.communicate(timeout=10)


if __name__ == "__main__":
    child(int(sys.argv[1])) if len(sys.argv) > 1 else main()
