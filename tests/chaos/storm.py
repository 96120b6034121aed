"""A storm of random legal messages on every input of every node of a launch.

`python -m tests.chaos.storm --help`. A process of its own, so that a crash of a kernel is seen as one; its last
line is what came of it, as JSON.
"""
# ruff: noqa: T201 (what it prints is its result)

from __future__ import annotations

import argparse
import faulthandler
import json
import resource
import signal
import sys
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from chefbot.bridge.inbox import WIRE_PUBLISHER
from chefbot.bridge.local_only import LOCAL_ONLY_TYPES, LOCAL_TOPICS
from chefbot.bridge.ports import ports_of
from chefbot.launcher.session import session, start
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import NavigationStatus
from chefbot.msgs.diagnostic_msgs import OK, DiagnosticArray
from chefbot.msgs.errors import InvalidMessageError
from chefbot.msgs.geometry_msgs import (
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    covariance_36,
)
from chefbot.msgs.idl.cdr import CdrError
from chefbot.msgs.idl.message import Message
from chefbot.msgs.nav_msgs import Odometry
from chefbot.msgs.std_msgs import Bool, Header, String
from chefbot.msgs.tf2_msgs import TFMessage
from chefbot.msgs.unique_identifier_msgs import UUID
from chefbot.msgs.validity import check, check_stamp
from chefbot.robot.load import load_robot
from chefbot.runtime.launch import load_launch
from chefbot.runtime.loop import Publication
from chefbot.runtime.node_container import NodeContainer
from tests.chaos.messages import Messages

SECOND = 1_000_000_000
AT_ONCE = 25
"""Messages at one instant, then the loop goes on for STEP_NS."""
STEP_NS = 50_000_000
WARM_UP = 3.0
HEAL, REACH = 10.0, 60.0
"""Seconds of simulated time after the storm to settle, and to reach a goal."""
SHARE_SEEN = 0.6
"""Of the messages are ones that were seen in the running launch, with one field changed."""
WORLD_CHANGES = ("simulation/drop_box", "simulation/kidnap", "simulation/door")
"""What changes the world itself for good; heard in a storm after which nothing is to be reached."""


class Target(NamedTuple):
    """An input: a topic and its type, and for an action what a goal is made of."""

    topic: str
    kind: type[Message]


class Storm:
    """One launch under fire."""

    def __init__(self, system: NodeContainer, seed: int, leave_out: tuple[str, ...]) -> None:
        self._system, self._leave_out = system, leave_out
        self._messages = Messages(seed)
        self._rng = np.random.default_rng([seed, 1])
        self._seen: dict[str, Message] = {}
        self.truth = SE2(0.0, 0.0, 0.0)
        self.static: dict[str, Message] = {}
        self.map: Message | None = None
        self.navigation = NavigationStatus()
        self.counts: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self.remarks: dict[str, int] = {}
        """What the robot says for people, and when last."""
        self.ours: Counter[str] = Counter()
        system.loop.add_observer(self._watch)

    def _watch(self, one: Publication) -> None:
        if one.publisher == WIRE_PUBLISHER:
            return
        self._seen[one.topic] = one.message
        if not self.counts["sent"]:
            self._check_ours(one)
        if isinstance(one.message, Odometry) and one.topic == "ground_truth":
            self.truth = one.message.pose.pose.se2
        elif isinstance(one.message, NavigationStatus):
            self.navigation = one.message
            self.remarks[f"{one.message.state} {one.message.reason}"] = one.time_ns
        elif one.topic.endswith("/remark") and isinstance(one.message, String):
            self.remarks[one.message.data] = one.time_ns
        elif isinstance(one.message, DiagnosticArray):
            self.remarks.update(
                {f"{x.name}: {x.message}": one.time_ns for x in one.message.status if x.level != OK}
            )

    def _check_ours(self, one: Publication) -> None:
        """What the robot's own nodes say has to pass at the border of every other robot."""
        try:
            check(one.message)
            check_stamp(one.message, one.time_ns)
        except InvalidMessageError as error:
            self.ours[f"{one.topic}: {error}"] += 1

    def targets(self) -> list[Target]:
        """Every input of every node, as the wire offers it; and the tree of frames."""
        found: dict[str, type[Message]] = {"tf": TFMessage, "tf_static": TFMessage}
        for node in self._system.nodes.values():
            ports = ports_of(node)
            found.update({one.name: one.kind for one in ports.subscriptions})
            for name, action in (*ports.action_servers, *ports.action_clients):
                found[f"{name}/_action/send_goal"] = action.send_goal
                found[f"{name}/_action/feedback"] = action.feedback_message
                found[f"{name}/_action/get_result"] = action.outcome
        inside = {name for name, kind in found.items() if name in LOCAL_TOPICS or kind in LOCAL_ONLY_TYPES}
        left_out = inside | set(self._leave_out)
        return [Target(name, kind) for name, kind in found.items() if name not in left_out]

    def blow(self, count: int) -> None:
        """So many messages."""
        targets, loop = self.targets(), self._system.loop
        for number in range(count):
            self._fire(targets[self._rng.integers(len(targets))])
            if number % AT_ONCE == 0:
                loop.run(until_ns=loop.now_ns + STEP_NS)
                print(json.dumps({"sent": number, "at": loop.now_ns / SECOND}), flush=True)

    def _fire(self, target: Target) -> None:
        self.counts["sent"] += 1
        message = self._made(target)
        print(f"{target.topic} {type(message).__name__}", file=sys.stderr)
        try:
            message = target.kind.from_cdr(message.to_cdr())
            check(message)
            if target.topic != "tf_static":
                check_stamp(message, self._system.loop.now_ns)
        except (InvalidMessageError, CdrError) as error:
            self.refused[f"{target.topic}: {error}"[:120]] += 1
            return
        self.counts["taken"] += 1
        self._system.loop.publish(target.topic, message, WIRE_PUBLISHER, from_device=True)

    def _made(self, target: Target) -> Message:
        seen = self._seen.get(target.topic)
        if seen is not None and self._rng.random() < SHARE_SEEN:
            return self._messages.changed(seen)
        made: Any = self._messages.any_of(target.kind)
        if "goal_id" in made.__struct_fields__:
            made = type(made)(UUID(self._rng.integers(0, 256, 16, np.uint8)), *list(_values(made))[1:])
        return made

    def heal(self, fixed: list[Message], saved_map: Message | None) -> None:
        """What an operator would do: fixed frames and map again, STOP released, the robot shown on the map."""
        loop = self._system.loop
        loop.run(until_ns=loop.now_ns + STEP_NS)  # what was sent last has come
        for message in fixed:
            loop.publish("tf_static", message, "operator", from_device=True, latched=True)
        self.remarks.clear()
        for pressed in (True, False):  # which also resets a board that has stopped by itself
            loop.publish("stop_request", Bool(pressed), "operator", from_device=True)
            loop.run(until_ns=loop.now_ns + STEP_NS)
        if saved_map is not None:
            loop.publish("map", saved_map, "operator", from_device=True, latched=True)
        loop.run(until_ns=loop.now_ns + round(HEAL * SECOND / 2))
        covariance = covariance_36(np.diag([0.04, 0.04, 0.02]))
        here = PoseWithCovariance(Pose.of(self.truth), covariance)
        click = PoseWithCovarianceStamped(Header.of(loop.now_ns, "map"), here)
        loop.publish("initialpose", click, "operator", from_device=True)
        loop.run(until_ns=loop.now_ns + round(HEAL * SECOND / 2))

    def reaches(self, goal: SE2) -> float:
        """Metres from the goal in the end."""
        loop = self._system.loop
        loop.publish(
            "goal_pose",
            PoseStamped(Header.of(loop.now_ns, "map"), Pose.of(goal)),
            "operator",
            from_device=True,
        )
        until = loop.now_ns + round(REACH * SECOND)
        loop.run(until_ns=until, until=lambda: self.truth.distance(goal) < 0.2)
        return self.truth.distance(goal)


def _values(message: Any) -> Any:
    return (getattr(message, name) for name in message.__struct_fields__)


def main() -> None:
    """As the options say."""
    options = _options()
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    resource.setrlimit(resource.RLIMIT_CPU, (options.cpu, options.cpu))
    arguments = {"world": "room", "people": "0", "pictures": "1", "headless": str(not options.page).lower()}
    arguments |= {"robot": options.robot, "port": str(options.port)} | (
        {"map_file": str(options.map)} if options.map else {}
    )
    known = load_launch(options.launch).args
    launch = load_launch(options.launch, {k: v for k, v in arguments.items() if k in known})
    with session(load_robot(options.robot), options.seed, "simulation", 0.0, None) as system:
        storm = Storm(system, options.seed, WORLD_CHANGES if options.goal else ())
        fixed: list[Message] = []
        system.loop.add_observer(
            lambda one: (
                fixed.append(one.message)
                if one.topic == "tf_static" and one.publisher != WIRE_PUBLISHER
                else None
            )
        )
        start(system, launch)
        system.loop.run(until_ns=system.loop.now_ns + round(WARM_UP * SECOND))
        saved_map = storm._seen.get("map")
        storm.blow(options.count)
        result: dict[str, Any] = {**storm.counts, "topics": len(storm.targets()), "ours": storm.ours}
        if options.goal:
            storm.heal(list(fixed), saved_map)
            home = SE2(0.0, 0.0, 0.0)
            goal = home if storm.truth.distance(home) > 0.5 else SE2(0.6, 0.0, 0.0)
            result["left"] = storm.reaches(goal)
            result["remarks"] = list(storm.remarks)[-20:]
            result["state"] = f"{storm.navigation.state} {storm.navigation.reason}"
        assert system.faults is not None
        result["faults"] = dict(system.faults.counts)
        result["unexpected"] = system.faults.bug_count
        result["worst"] = {
            k: v.worst_ns / 1e9
            for k, v in sorted(system.loop.timings.items(), key=lambda x: -x[1].worst_ns)[:8]
        }
        result["refused"] = dict(storm.refused.most_common(options.shown))
    print(json.dumps(result))


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
    parser.add_argument("--page", action="store_true", help="with the web UI")
    parser.add_argument("--port", type=int, default=18790, help="of the page")
    parser.add_argument("--goal", action="store_true", help="in the end the robot has to reach a goal")
    parser.add_argument("--shown", type=int, default=0, help="so many reasons of refusals")
    return parser.parse_args()


if __name__ == "__main__":
    main()
