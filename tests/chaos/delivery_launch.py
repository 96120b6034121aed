"""Launches deliveries in several processes in a small room with a saved map, and observes the robot."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
import zenoh

from chefbot.demo.processes import split_into_processes
from chefbot.demo.summary import ground_truth_map
from chefbot.maths.se2 import IDENTITY
from chefbot.msgs.chefbot_msgs import DeliveryStatus, Order, WheelSpeeds
from chefbot.msgs.geometry_msgs import PoseWithCovariance, PoseWithCovarianceStamped, covariance_36
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Bool, Empty, Header
from chefbot.robot.load import load_robot
from chefbot.ros2.rmw.liveliness import NODE, ROOT, parse_token
from chefbot.ros2.rmw.node import RmwNode
from chefbot.ros2.rmw.qos import TRANSIENT_LOCAL_QOS
from chefbot.runtime.launch import Launch, load_launch, split_by_process
from chefbot.sim.world.load import load_any_world
from chefbot.storage.map_files import save_map
from chefbot.storage.places import places_path, save_places
from tests.chaos.launch_process import LaunchProcess, free_port, run_chefbot, wait_for
from tests.support import waiting

WORLD, ROBOT = "room", "chefbot_lidar"
DOMAIN = 0
ARRIVED_M = 0.35
"""Largest distance from the place at which a robot counts as arrived, metres."""
RVIZ_VARIANCES = (0.25, 0.25, 0.0685)
"""Variances of x, y and yaw that RViz publishes with an initial pose; m^2 and rad^2."""


def delivery_launch(folder: Path) -> tuple[Path, Launch]:
    """Write a launch file for deliveries on the ground-truth map."""
    robot = load_robot(ROBOT)
    world = load_any_world(WORLD, robot)
    saved = save_map(folder / "map", ground_truth_map(world, robot))
    save_places(places_path(saved), {name: world.start.between(at) for name, at in world.places.items()})
    return demo_launch(folder, "waiter", map_file=str(saved))


def demo_launch(folder: Path, name: str, **arguments: str) -> tuple[Path, Launch]:
    """Write a launch file in which each node runs in the process that `chefbot demo --processes` gives it."""
    given = {"world": WORLD, "robot": ROBOT, "port": str(free_port()), "people": "0", **arguments}
    launch = split_into_processes(load_launch(name, given))
    nodes = {
        name: {"kind": node.kind, "params": node.params, "remap": node.remap, "process": node.process}
        for name, node in launch.nodes.items()
    }
    path = folder / f"{name}_processes.yaml"
    path.write_text(yaml.safe_dump({"args": {"robot": ROBOT}, "nodes": nodes}))
    return path, launch


class GraphEvent(NamedTuple):
    """A node that has appeared or disappeared at a time (s), and the names of all nodes in the graph afterwards."""

    at: float
    node: str
    appeared: bool
    nodes: frozenset[str]


class DeliveryObserver:
    """A node on the network of a launch that records what the robot publishes, sends orders and loads the food."""

    def __init__(self, chefbot: LaunchProcess, node: RmwNode, launch: Launch) -> None:
        self.chefbot, self.node = chefbot, node
        self.processes = split_by_process(launch)[1]
        self.speeds: list[tuple[float, WheelSpeeds]] = []
        self.deliveries: list[DeliveryStatus] = []
        self.localized: list[bool] = []
        self.truth: list[Odometry] = []
        world = load_any_world(WORLD, load_robot(ROBOT))
        self.places = {place: world.start.between(at) for place, at in world.places.items()}
        node.subscription("/wheel_speeds", WheelSpeeds, self._on_wheel_speeds)
        self._loaded = node.publisher("/loaded", Empty)
        node.subscription("/delivery_status", DeliveryStatus, self._on_delivery_status, TRANSIENT_LOCAL_QOS)
        node.subscription(
            "/localized", Bool, lambda message: self.localized.append(message.data), TRANSIENT_LOCAL_QOS
        )
        self.estimates: list[PoseWithCovarianceStamped] = []
        node.subscription("/ground_truth", Odometry, self.truth.append)
        node.subscription("/amcl_pose", PoseWithCovarianceStamped, self.estimates.append, TRANSIENT_LOCAL_QOS)
        self.graph_events: list[GraphEvent] = []
        self._nodes: dict[str, str] = {}
        """Names of the nodes by their liveliness tokens."""
        self._tokens = node.wire.session.liveliness().declare_subscriber(
            f"{ROOT}/{DOMAIN}/*/*/*/{NODE}/**", self._on_token, history=True
        )
        self._order = node.publisher("/order", Order)
        self._initial_pose = node.publisher("/initialpose", PoseWithCovarianceStamped)

    def _on_delivery_status(self, status: DeliveryStatus) -> None:
        """Confirm loading as soon as the robot waits for it."""
        self.deliveries.append(status)
        if status.state == "loading":
            self._loaded.publish(Empty())

    def _on_wheel_speeds(self, speeds: WheelSpeeds) -> None:
        self.speeds.append((time.monotonic(), speeds))

    def _on_token(self, sample: zenoh.Sample) -> None:
        """Record that a node has appeared or disappeared; it must be quick, as it delays the next messages."""
        text = str(sample.key_expr)
        appeared = sample.kind == zenoh.SampleKind.PUT
        name = parse_token(text).node.name
        if appeared:
            self._nodes[text] = name
        else:
            self._nodes.pop(text, None)
        self.graph_events.append(
            GraphEvent(time.monotonic(), name, appeared, frozenset(self._nodes.values()))
        )

    def drives(self) -> bool:
        """Return whether a wheel turns at more than 2 rad/s."""
        return bool(self.speeds) and max(abs(self.speeds[-1][1].left), abs(self.speeds[-1][1].right)) > 2.0

    def travelled(self) -> float:
        """Return the distance from the start, metres."""
        return self.truth[-1].pose.pose.se2.distance(IDENTITY) if self.truth else 0.0

    def is_up(self, process: str) -> bool:
        """Return whether all nodes of a process are in the graph."""
        return self.processes[process].nodes.keys() <= {found.name for found in self.node.wire.graph.nodes()}

    def delivery_is(self, state: str, place: str) -> bool:
        return bool(self.deliveries) and (self.deliveries[-1].state, self.deliveries[-1].place) == (
            state,
            place,
        )

    def await_arrival(self, table: str) -> None:
        """Wait until the robot offers the food at a table; AssertionError with the robot's reason if it skips it."""
        wait_for(lambda: self.delivery_is("waiting", table) or self.deliveries[-1].skipped_reasons)
        assert self.delivery_is("waiting", table), self.deliveries[-1].skipped_reasons

    def localize(self) -> None:
        """Publish the true pose as the initial pose; the robot may have turned since the start to localize itself."""
        wait_for(
            lambda: (
                all(map(self.is_up, self.processes))
                and all(end.has_subscribers for end in (self._initial_pose, self._order, self._loaded))
                and self.truth
            )
        )
        pose = PoseWithCovariance(self.truth[-1].pose.pose, covariance_36(np.diag(RVIZ_VARIANCES)))
        self._initial_pose.publish(PoseWithCovarianceStamped(Header.of(0, "map"), pose))
        wait_for(lambda: self.localized and self.estimates)
        assert self.localized == [True]
        assert self._error() < ARRIVED_M, f"the estimated pose is {self.estimates[-1].pose.pose.se2}"

    def _error(self) -> float:
        """Return the distance between the newest estimate and the true position at its time, metres."""
        estimate = self.estimates[-1]
        stamp = estimate.header.stamp.ns
        true = min(self.truth, key=lambda truth: abs(truth.header.stamp.ns - stamp))
        return true.pose.pose.se2.distance(estimate.pose.pose.se2)

    def order(self, *tables: str) -> None:
        self._order.publish(Order(tables))

    def distance_to(self, place: str) -> float:
        """Return the distance from the true position to a place, metres."""
        return self.truth[-1].pose.pose.se2.distance(self.places[place])


class ProcessFault:
    """Kills or suspends a process while the robot drives; measures how the robot stops and the process returns."""

    def __init__(self, observer: DeliveryObserver, process: str, fault: str = "killed") -> None:
        self._observer, self._process = observer, process
        wait_for(observer.drives)
        self._speed_count, self._event_count = len(observer.speeds), len(observer.graph_events)
        self._last, self._wall = observer.speeds[-1][1], time.monotonic()
        self.pid = observer.chefbot.inject(fault, process)
        wait_for(lambda: self._first_stop() is not None)
        stop = self._first_stop()
        assert stop is not None
        self.stopped_ms = (stop[1].header.stamp.ns - self._last.header.stamp.ns) / 1e6
        """Simulated time from the last command before the fault to the first that is a stop, ms."""
        self._stopped = stop[0]

    def _first_stop(self) -> tuple[float, WheelSpeeds] | None:
        commands = self._observer.speeds[self._speed_count :]
        return next((item for item in commands if item[1].left == item[1].right == 0.0), None)

    def wait_until_back(self) -> float:
        """Return the wall time from the fault until the process is up; check that the robot stands while it is away.

        It may drive as soon as the first node is back: messages of several processes arrive in any order.
        """
        observer, nodes = self._observer, self._observer.processes[self._process].nodes.keys()
        absent = self._first(lambda event: not nodes <= event.nodes)
        returning = self._first(lambda event: event.at > absent and event.appeared and event.node in nodes)
        back = self._first(lambda event: event.at > absent and nodes <= event.nodes)
        wait_for(lambda: observer.speeds[-1][0] > back)
        commands = observer.speeds[self._speed_count :]
        meanwhile = [(at, speeds) for at, speeds in commands if self._stopped < at < returning]
        moved = [
            f"{at - returning:.3f} s: {speeds.left:.2f}, {speeds.right:.2f}"
            for at, speeds in meanwhile
            if speeds.left or speeds.right
        ]
        assert not moved, (
            f"stopped {returning - self._stopped:.3f} s and absent {returning - absent:.3f} s before its first node "
            f"was back; {moved}"
        )
        return back - self._wall

    def _first(self, condition: Callable[[GraphEvent], bool]) -> float:
        """Return the first time after the fault at which an event met the condition."""
        events = self._observer.graph_events
        return waiting.wait_for(
            lambda: next((event.at for event in events[self._event_count :] if condition(event)), 0.0),
            self._process,
        )


@contextmanager
def localized_robot(folder: Path, *arguments: str) -> Iterator[DeliveryObserver]:
    """Launch a robot that knows its pose and waits for an order."""
    path, launch = delivery_launch(folder)
    with run_chefbot("launch", str(path), *arguments) as (chefbot, node):
        observer = DeliveryObserver(chefbot, node, launch)
        observer.localize()
        yield observer
