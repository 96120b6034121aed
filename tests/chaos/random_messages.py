"""Publishes random messages on the inputs of all nodes of a launch and prints the result as JSON on the last line.

`python -m tests.chaos.random_messages --help` lists the options. The test starts it as a process of its own, so that
a crash in a kernel is seen by its exit code.
"""
# ruff: noqa: T201 (its output is the result)

from __future__ import annotations

import argparse
import faulthandler
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from chefbot.bridge.inbox import WIRE_PUBLISHER
from chefbot.bridge.local_only import LOCAL_ONLY_TYPES, LOCAL_TOPICS
from chefbot.bridge.ports import ports_of
from chefbot.devices.state_files import VARIABLE
from chefbot.launcher.session import session, start
from chefbot.maths.se2 import SE2
from chefbot.msgs.action_msgs import CancelGoal_Request
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.diagnostic_msgs import OK, DiagnosticArray
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    covariance_36,
)
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.errors import InvalidMessageError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav2_msgs import SpeedLimit
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.msgs.validity import check, check_stamp
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import Launch, load_launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from tests.chaos.callback_cpu_time import (
    callbacks_measured_in_cpu_time,
    is_of_the_robot,
    worst_callbacks,
)
from tests.chaos.message_generator import MessageGenerator

SECOND = 1_000_000_000
MESSAGES_PER_STEP = 25
"""Messages at one instant, after which the loop runs for STEP_NS."""
MAX_ATTEMPTS = 30
"""Messages generated for each that the bridge would accept; of transforms, about one of ten is."""
STEP_NS = 50_000_000
WARM_UP = 3.0
RECOVERY_TIME, GOAL_TIMEOUT = 10.0, 150.0
"""Seconds of simulated time after the random messages, for recovery and to reach a goal. The collision monitor
remembers obstacles that were published behind the robot for `monitor.obstacle_memory_time`, 60 s."""
MAIN_LAUNCHES = ("waiter", "explore", "amcl_demo", "gmapping_demo", "calibrate_sim")
"""Launches that together contain all nodes of the robot."""
LIMIT_MS = 50.0
"""CPU time of a callback above which it is reported with the messages that were published before, ms."""
LIMITS_MS = {
    "amcl <- scan": 2000.0,
    "amcl <- reinitialize_global_localization": 1000.0,
    "global_localizer <- scan": 2000.0,
    "gmapping <- scan": 500.0,
    "calibrator <- scan": 1000.0,
    "planner <- map": 100.0,
}
"""Limits of callbacks that compute longer by design: global localization weighs 400,000 particles once, a scan that
fits nowhere makes the mapper search all its particles, the calibrator matches scans while the robot stands, and with
random odometry the mapper's map grows to nearly 64 million cells (`max_cells`), which the planner inflates."""
HARDWARE = ("motor_board", "keyboard", "gamepad", "remote_drive", "viewer")
"""Modules of devices that are left out, because they need a board, a terminal, a gamepad or a running robot."""
MUTATED_SHARE = 0.6
"""Share of the messages that are mutations of a message that the launch has published; the others are generated."""
WORLD_CHANGES = ("simulation/drop_box", "simulation/kidnap", "simulation/door")
"""Topics that change the simulated world permanently; they are left out if the robot has to reach a goal later."""


class Target(NamedTuple):
    """A topic that a node subscribes to, or a message of an action, with its type."""

    topic: str
    kind: type[Message]


class RandomMessages:
    """Publishes random messages into a running launch and observes how the robot behaves."""

    def __init__(self, system: NodeContainer, seed: int, leave_out: tuple[str, ...]) -> None:
        self._system, self._leave_out = system, leave_out
        self._generator = MessageGenerator(seed)
        self._rng = np.random.default_rng([seed, 1])
        self._seen: dict[str, Message] = {}
        self.truth = SE2(0.0, 0.0, 0.0)
        self.save: Path | None = None
        """Folder for the messages before each slow callback."""
        self.navigation = NavigationStatus()
        self.counts: Counter[str] = Counter()
        self.rejected: Counter[str] = Counter()
        self.notices: dict[str, int] = {}
        """The time at which each notice, state of navigation and diagnostic that is not OK was last published."""
        self.invalid_own: Counter[str] = Counter()
        self.slow: dict[str, tuple[float, list[str]]] = {}
        """By callback, the longest CPU time above its limit, ms, and the topics of the messages of its step."""
        self._step: list[tuple[str, Message]] = []
        self._worst_ns: dict[str, int] = {}
        system.loop.add_observer(self._observe)

    def _observe(self, publication: Publication) -> None:
        if publication.publisher == WIRE_PUBLISHER:
            return
        self._seen[publication.topic] = publication.message
        if not self.counts["generated"]:
            self._check_own_message(publication)
        if isinstance(publication.message, Odometry) and publication.topic == "ground_truth":
            self.truth = publication.message.pose.pose.se2
        elif isinstance(publication.message, NavigationStatus):
            self.navigation = publication.message
            self.notices[f"{publication.message.state} {publication.message.reason}"] = publication.time_ns
        elif publication.topic.endswith("/notice") and isinstance(publication.message, String):
            self.notices[publication.message.data] = publication.time_ns
        elif isinstance(publication.message, DiagnosticArray):
            self.notices.update(
                {
                    f"{x.name}: {x.message}": publication.time_ns
                    for x in publication.message.status
                    if x.level != OK
                }
            )

    def _check_own_message(self, publication: Publication) -> None:
        """Count messages of the robot's own nodes that the bridge of another robot would reject."""
        try:
            check(publication.message)
            check_stamp(publication.message, publication.time_ns)
        except InvalidMessageError as error:
            self.invalid_own[f"{publication.topic}: {error}"] += 1

    def targets(self) -> list[Target]:
        """Return the inputs of all nodes that the bridge makes available to ROS 2, and the transform topics."""
        found: dict[str, type[Message]] = {"tf": TFMessage, "tf_static": TFMessage}
        for node in self._system.nodes.values():
            ports = ports_of(node)
            found.update({port.name: port.kind for port in ports.subscriptions})
            for name, action in (*ports.action_servers, *ports.action_clients):
                found[f"{name}/_action/send_goal"] = action.send_goal
                found[f"{name}/_action/cancel_goal"] = CancelGoal_Request
                found[f"{name}/_action/feedback"] = action.feedback_message
                found[f"{name}/_action/get_result"] = action.outcome
        local = {name for name, kind in found.items() if name in LOCAL_TOPICS or kind in LOCAL_ONLY_TYPES}
        left_out = local | set(self._leave_out)
        return [Target(name, kind) for name, kind in found.items() if name not in left_out]

    def publish(self, count: int) -> None:
        """Publish random messages on random targets until `count` are accepted, and run the loop meanwhile."""
        targets, loop = self.targets(), self._system.loop
        while self.counts["accepted"] < count and self.counts["generated"] < MAX_ATTEMPTS * count:
            self._publish_one(targets[self._rng.integers(len(targets))])
            if len(self._step) == MESSAGES_PER_STEP or self.counts["accepted"] == count:
                print(f"at {loop.now_ns}: {' '.join(topic for topic, _ in self._step)}", file=sys.stderr)
                loop.run(until_ns=loop.now_ns + STEP_NS)
                self._find_slow_callbacks()

    def _find_slow_callbacks(self) -> None:
        """Note the callbacks that took longer than ever before and than their limit in the last step."""
        for name, timing in self._system.loop.timings.items():
            worst_ns = timing.worst_ns
            limit_ns = 1e6 * LIMITS_MS.get(name, LIMIT_MS)
            if is_of_the_robot(timing) and worst_ns > max(self._worst_ns.get(name, 0), limit_ns):
                self._worst_ns[name] = worst_ns
                self.slow[name] = (round(worst_ns / 1e6, 1), [topic for topic, _ in self._step])
                if self.save is not None:
                    self._save_step(self.save / name.replace("/", "_"))
        self._step.clear()

    def _save_step(self, folder: Path) -> None:
        """Write the messages of the last step, so that a slow callback can be examined."""
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        for number, (topic, message) in enumerate(self._step):
            kind = f"{type(message).__module__.rpartition('.')[2]}.{type(message).__name__}"
            (folder / f"{number:02} {topic.replace('/', '_')} {kind}").write_bytes(message.to_cdr())

    def _publish_one(self, target: Target) -> None:
        self.counts["generated"] += 1
        message = self._generate(target)
        try:
            message = target.kind.from_cdr(message.to_cdr())
            check(message)
            if target.topic != "tf_static":
                check_stamp(message, self._system.loop.now_ns)
        except (InvalidMessageError, CdrError) as error:
            self.rejected[f"{target.topic}: {error}"[:120]] += 1
            return
        self.counts["accepted"] += 1
        self._step.append((target.topic, message))
        self._system.loop.publish(target.topic, message, WIRE_PUBLISHER, from_device=True)

    def _generate(self, target: Target) -> Message:
        seen = self._seen.get(target.topic)
        if seen is not None and self._rng.random() < MUTATED_SHARE:
            return self._generator.mutate(seen)
        generated: Any = self._generator.generate(target.kind)
        if "goal_id" in generated.__struct_fields__:
            identity = UUID(self._rng.integers(0, 256, 16, np.uint8))
            generated = type(generated)(identity, *list(_values(generated))[1:])
        return generated

    def recover(self, static_transforms: list[Message], saved_map: Message | None) -> None:
        """Act as an operator: publish static transforms and map again, end stop and speed limit, set the pose."""
        loop = self._system.loop
        loop.run(until_ns=loop.now_ns + STEP_NS)  # the last messages are delivered
        for message in static_transforms:
            loop.publish("tf_static", message, "operator", from_device=True, latched=True)
        self.notices.clear()
        for pressed in (True, False):  # this also resets a board that has stopped by itself
            loop.publish("stop_request", Bool(pressed), "operator", from_device=True)
            loop.run(until_ns=loop.now_ns + STEP_NS)
        loop.publish("speed_limit", SpeedLimit(), "operator", from_device=True, latched=True)
        if saved_map is not None:
            loop.publish("map", saved_map, "operator", from_device=True, latched=True)
        loop.run(until_ns=loop.now_ns + round(RECOVERY_TIME * SECOND / 2))
        covariance = covariance_36(np.diag([0.04, 0.04, 0.02]))
        pose = PoseWithCovariance(Pose.of(self.truth), covariance)
        initial_pose = PoseWithCovarianceStamped(Header.of(loop.now_ns, "map"), pose)
        loop.publish("initialpose", initial_pose, "operator", from_device=True)
        loop.run(until_ns=loop.now_ns + round(RECOVERY_TIME * SECOND / 2))

    def distance_after_driving_to(self, goal: SE2) -> float:
        """Send a goal and return the distance to it when it is reached or the time is over, metres."""
        loop = self._system.loop
        loop.publish(
            "goal_pose",
            PoseStamped(Header.of(loop.now_ns, "map"), Pose.of(goal)),
            "operator",
            from_device=True,
        )
        until = loop.now_ns + round(GOAL_TIMEOUT * SECOND)
        loop.run(until_ns=until, until=lambda: self.truth.distance(goal) < 0.2)
        return self.truth.distance(goal)


def _values(message: Any) -> Any:
    return (getattr(message, name) for name in message.__struct_fields__)


def without_hardware(launch: Launch) -> Launch:
    """Return the launch without the devices that do not exist on a computer without a robot."""
    nodes = {
        name: entry
        for name, entry in launch.nodes.items()
        if entry.kind.partition(":")[0].rpartition(".")[2] not in HARDWARE
    }
    return msgspec.structs.replace(launch, nodes=nodes)


def main() -> None:
    """Run the launch of the options under random messages and print the result."""
    with callbacks_measured_in_cpu_time():
        print(json.dumps(run(_options())))


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Run the launch under random messages and return the result."""
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    resource.setrlimit(resource.RLIMIT_CPU, (options.cpu, options.cpu))
    os.environ[VARIABLE] = tempfile.mkdtemp(prefix="random_messages_")  # not the user's emergency stop
    arguments = {"world": "room", "people": "0", "pictures": "1", "headless": str(not options.web_ui).lower()}
    arguments |= {"robot": options.robot, "port": str(options.port)} | (
        {"map_file": str(options.map)} if options.map else {}
    )
    accepted = load_launch(options.launch).args
    launch = without_hardware(
        load_launch(options.launch, {k: v for k, v in arguments.items() if k in accepted})
    )
    with session(load_robot(options.robot), options.seed, "simulation", 0.0, None) as system:
        messages = RandomMessages(system, options.seed, WORLD_CHANGES if options.goal else ())
        messages.save = options.save
        static_transforms: list[Message] = []
        system.loop.add_observer(
            lambda publication: (
                static_transforms.append(publication.message)
                if publication.topic == "tf_static" and publication.publisher != WIRE_PUBLISHER
                else None
            )
        )
        start(system, launch)
        system.loop.run(until_ns=system.loop.now_ns + round(WARM_UP * SECOND))
        saved_map = messages._seen.get("map")
        messages.publish(options.count)
        result: dict[str, Any] = {
            **messages.counts,
            "topics": len(messages.targets()),
            "invalid_own": messages.invalid_own,
        }
        if options.goal:
            messages.recover(list(static_transforms), saved_map)
            home = SE2(0.0, 0.0, 0.0)
            goal = home if messages.truth.distance(home) > 0.5 else SE2(0.6, 0.0, 0.0)
            result["goal_distance"] = messages.distance_after_driving_to(goal)
            result["notices"] = {text: at / 1e9 for text, at in list(messages.notices.items())[-20:]}
            result["state"] = f"{messages.navigation.state} {messages.navigation.reason}"
        assert system.faults is not None
        result["faults"] = dict(system.faults.counts)
        result["unexpected"] = system.faults.bug_count
        result["worst_ms"] = worst_callbacks(system.loop, 12)
        result["slow"] = messages.slow
        result["cpu_s"] = round(time.process_time(), 1)
        result["rejected"] = dict(messages.rejected.most_common(options.shown))
    return result


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--launch", default="waiter")
    parser.add_argument("--robot", default="chefbot_lidar")
    parser.add_argument("--map", type=Path)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--cpu", type=int, default=500, help="seconds of CPU after which the process is killed"
    )
    parser.add_argument("--web-ui", action="store_true", help="serve the web UI")
    parser.add_argument("--port", type=int, default=18790, help="port of the web UI")
    parser.add_argument("--goal", action="store_true", help="send the robot to a goal afterwards")
    parser.add_argument("--save", type=Path, help="folder for the messages before each slow callback")
    parser.add_argument("--shown", type=int, default=0, help="how many reasons of rejections to print")
    return parser.parse_args()


if __name__ == "__main__":
    main()
