"""The demo's waiter in its processes, on a map that is there already, in a small room."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

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
from tests.chaos.launched import Launched, free_port, running, wait_for
from tests.support import waiting

WORLD, ROBOT = "room", "chefbot_lidar"
DOMAIN = 0
ARRIVED_M = 0.35
"""Metres from where it should be."""
RVIZ_VARIANCES = (0.25, 0.25, 0.0685)
"""Of x, y and yaw, as RViz's button gives them; m^2 and rad^2."""


def waiter(folder: Path) -> tuple[Path, Launch]:
    """The demo's second half, with a map as a perfect mapper would draw it."""
    robot = load_robot(ROBOT)
    world = load_any_world(WORLD, robot)
    saved = save_map(folder / "map", ground_truth_map(world, robot))
    save_places(places_path(saved), {name: world.start.between(at) for name, at in world.places.items()})
    return demo_launch(folder, "waiter", map_file=str(saved))


def demo_launch(folder: Path, name: str, **arguments: str) -> tuple[Path, Launch]:
    """A launch file with every node in the process that `chefbot demo --processes` gives it."""
    given = {"world": WORLD, "robot": ROBOT, "port": str(free_port()), "people": "0", **arguments}
    launch = split_into_processes(load_launch(name, given))
    nodes = {
        name: {"kind": one.kind, "params": one.params, "remap": one.remap, "process": one.process}
        for name, one in launch.nodes.items()
    }
    path = folder / f"{name}_parts.yaml"
    path.write_text(yaml.safe_dump({"args": {"robot": ROBOT}, "nodes": nodes}))
    return path, launch


class Watched:
    """What an outsider sees of it."""

    def __init__(self, one: Launched, node: RmwNode, launch: Launch) -> None:
        self.one, self.node = one, node
        self.parts = split_by_process(launch)[1]
        self.speeds: list[tuple[float, WheelSpeeds]] = []
        self.deliveries: list[DeliveryStatus] = []
        self.found: list[bool] = []
        self.truth: list[Odometry] = []
        world = load_any_world(WORLD, load_robot(ROBOT))
        self.places = {place: world.start.between(at) for place, at in world.places.items()}
        node.subscription("/wheel_speeds", WheelSpeeds, self._drive)
        self._loaded = node.publisher("/loaded", Empty)
        node.subscription("/delivery_status", DeliveryStatus, self._see, TRANSIENT_LOCAL_QOS)
        node.subscription("/localized", Bool, lambda said: self.found.append(said.data), TRANSIENT_LOCAL_QOS)
        self.estimates: list[PoseWithCovarianceStamped] = []
        node.subscription("/ground_truth", Odometry, self.truth.append)
        node.subscription("/amcl_pose", PoseWithCovarianceStamped, self.estimates.append, TRANSIENT_LOCAL_QOS)
        self.seen_there: list[tuple[float, frozenset[str]]] = []
        """When which processes had all their nodes on the wire, by the order in which it came over the wire."""
        self._nodes: dict[str, str] = {}
        """Name of the node by its liveliness token."""
        self._tokens = node.wire.session.liveliness().declare_subscriber(
            f"{ROOT}/{DOMAIN}/*/*/*/{NODE}/**", self._look, history=True
        )
        self._order = node.publisher("/order", Order)
        self._click = node.publisher("/initialpose", PoseWithCovarianceStamped)

    def _see(self, said: DeliveryStatus) -> None:
        """The cook loads as soon as the robot is there."""
        self.deliveries.append(said)
        if said.state == "loading":
            self._loaded.publish(Empty())

    def _drive(self, said: WheelSpeeds) -> None:
        self.speeds.append((time.monotonic(), said))

    def _look(self, sample: zenoh.Sample) -> None:
        """A node came or went. Quick, as what the robot publishes next waits for it."""
        text = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._nodes[text] = parse_token(text).node.name
        else:
            self._nodes.pop(text, None)
        here = set(self._nodes.values())
        there = frozenset(name for name, part in self.parts.items() if part.nodes.keys() <= here)
        self.seen_there.append((time.monotonic(), there))

    def drives(self) -> bool:
        """At more than a creep."""
        return bool(self.speeds) and max(abs(self.speeds[-1][1].left), abs(self.speeds[-1][1].right)) > 2.0

    def travelled(self) -> float:
        """Metres from where it began."""
        return self.truth[-1].pose.pose.se2.distance(IDENTITY) if self.truth else 0.0

    def there(self, process: str) -> bool:
        """Whether all of its nodes are on the wire."""
        return self.parts[process].nodes.keys() <= {found.name for found in self.node.wire.graph.nodes()}

    def has(self, state: str, place: str) -> bool:
        return bool(self.deliveries) and (self.deliveries[-1].state, self.deliveries[-1].place) == (
            state,
            place,
        )

    def await_arrival(self, table: str) -> None:
        """With the food; AssertionError with the robot's reason if it gives up."""
        wait_for(lambda: self.has("waiting", table) or self.deliveries[-1].skipped_reasons)
        assert self.has("waiting", table), self.deliveries[-1].skipped_reasons

    def find_itself(self) -> None:
        """Told where it stands, which is no longer where it began: a lost robot turns to look around."""
        wait_for(
            lambda: (
                all(map(self.there, self.parts))
                and all(one.has_subscribers for one in (self._click, self._order, self._loaded))
                and self.truth
            )
        )
        here = PoseWithCovariance(self.truth[-1].pose.pose, covariance_36(np.diag(RVIZ_VARIANCES)))
        self._click.publish(PoseWithCovarianceStamped(Header.of(0, "map"), here))
        wait_for(lambda: self.found and self.estimates)
        assert self.found == [True]
        assert self._error() < ARRIVED_M, f"it believes to be at {self.estimates[-1].pose.pose.se2}"

    def _error(self) -> float:
        """Metres between where it was at its newest estimate and where it believed to be."""
        said = self.estimates[-1]
        stamp = said.header.stamp.ns
        true = min(self.truth, key=lambda one: abs(one.header.stamp.ns - stamp))
        return true.pose.pose.se2.distance(said.pose.pose.se2)

    def order(self, *tables: str) -> None:
        self._order.publish(Order(tables))

    def at(self, place: str) -> float:
        """Metres from where it truly is."""
        return self.truth[-1].pose.pose.se2.distance(self.places[place])


class Blow:
    """A process killed, or stopped, while it drives: what followed."""

    def __init__(self, watched: Watched, process: str, by: signal.Signals = signal.SIGKILL) -> None:
        self._watched, self._process = watched, process
        wait_for(watched.drives)
        self._count, self._looks = len(watched.speeds), len(watched.seen_there)
        self._last, self._wall = watched.speeds[-1][1], time.monotonic()
        self.pid = watched.one.kill(process, by)
        wait_for(lambda: self._still() is not None)
        still = self._still()
        assert still is not None
        self.stopped_ms = (still[1].header.stamp.ns - self._last.header.stamp.ns) / 1e6
        """Of the robot's time, from the last command before the blow to the first that is a stop."""
        self._stood = still[0]

    def _still(self) -> tuple[float, WheelSpeeds] | None:
        said = self._watched.speeds[self._count :]
        return next((one for one in said if one[1].left == one[1].right == 0.0), None)

    def wait_until_back(self) -> float:
        """Seconds of the wall from the blow; while it was away the robot stood."""
        watched = self._watched
        gone = self._first(lambda _, there: self._process not in there)
        back = self._first(lambda at, there: at > gone and self._process in there)
        wait_for(lambda: watched.speeds[-1][0] > back)
        away = [(at, one) for at, one in watched.speeds[self._count :] if self._stood < at < back]
        moved = [
            f"{at - back:.3f} s: {one.left:.2f}, {one.right:.2f}" for at, one in away if one.left or one.right
        ]
        assert not moved, (
            f"stood {back - self._stood:.3f} s, gone {back - gone:.3f} s before it was back; {moved}"
        )
        return back - self._wall

    def _first(self, condition: Callable[[float, frozenset[str]], bool]) -> float:
        """When the processes that are there first met the condition, from the blow on."""
        seen = self._watched.seen_there
        return waiting.wait_for(
            lambda: next((at for at, there in seen[self._looks :] if condition(at, there)), 0.0),
            self._process,
        )


@contextmanager
def waiting_robot(folder: Path, *arguments: str) -> Iterator[Watched]:
    """It has found itself and waits for an order."""
    path, launch = waiter(folder)
    with running("launch", str(path), *arguments) as (one, node):
        watched = Watched(one, node, launch)
        watched.find_itself()
        yield watched
