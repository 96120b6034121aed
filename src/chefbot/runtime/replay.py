"""Replay of a log: its devices speak from the file, its nodes think again, and what they say is compared."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from mcap.exceptions import McapError
from mcap.reader import make_reader

from chefbot.errors import UserError
from chefbot.msgs.registry import message_type
from chefbot.msgs.std_msgs import String
from chefbot.robot.spec import Robot
from chefbot.runtime.clock import Clock, StepClock
from chefbot.runtime.launch import Launch, node_class
from chefbot.runtime.loop import DEVICE, Loop, Publication
from chefbot.runtime.node import Device, Node, listens_to
from chefbot.runtime.record import IMAGES, METADATA
from chefbot.runtime.system import LAUNCH_TOPIC, System


class Logged(NamedTuple):
    """One message of a log."""

    topic: str
    kind: str
    data: bytes
    time_ns: int
    publisher: str
    from_device: bool
    latched: bool


@dataclass(frozen=True)
class Log:
    """A whole log: what it was made with, and its messages in the order of publication."""

    robot: Robot
    seed: int
    images: bool
    messages: list[Logged]


class Difference(NamedTuple):
    """Where a replay and its log part."""

    index: int
    logged: str
    replayed: str


def read_log(path: Path) -> Log:
    """A log as `Recorder` writes it. UserError when it is missing, damaged, or somebody else's."""
    try:
        with path.open("rb") as file:
            return _read(path, file)
    except OSError as error:
        raise UserError(f"log {path} cannot be read: {error.strerror}") from None
    except (McapError, ValueError, EOFError, KeyError, IndexError, MemoryError) as error:
        reason = str(error) or type(error).__name__
        raise UserError(f"log {path} is damaged or cut off, it cannot be replayed: {reason}") from None


def _read(path: Path, file: Any) -> Log:
    reader = make_reader(file, validate_crcs=True)
    about = {record.name: record.metadata for record in reader.iter_metadata()}.get(METADATA)
    if about is None:
        raise UserError(
            f"log {path} was not recorded by chefbot: it does not say which robot and launch made it"
        )
    messages = [
        Logged(
            channel.topic.lstrip("/"),
            schema.name if schema else "",
            message.data,
            message.log_time,
            channel.metadata.get("publisher", ""),
            channel.metadata.get("from_device") == "True",
            channel.metadata.get("latched") == "True",
        )
        for schema, channel, message in reader.iter_messages(log_time_order=False)
    ]
    robot = msgspec.json.decode(about["robot"], type=Robot)
    return Log(robot, int(about["seed"]), about["images"] == "True", messages)


class Replay:
    """Runs a log through its nodes. `differences` is empty when every byte came out again."""

    def __init__(self, log: Log, clock: Clock | None = None) -> None:
        self.log = log
        self.compared = 0
        self.differences: list[Difference] = []
        start = log.messages[0].time_ns if log.messages else 0
        self.system = System(Loop(clock or StepClock(), start), log.robot, log.seed)
        self._thinking: set[str] = set()
        """Nodes that run; everybody else speaks from the log."""
        self._expected: deque[Logged] = deque()
        self._pending = self._scheduled()
        self.system.loop.tap(self._compare)

    def run(self, progress: Callable[[int, int], None] | None = None) -> None:
        """To the end of the log; `progress(messages done, all)` now and then."""
        loop = self.system.loop
        for done, (time_ns, batch) in enumerate(self._pending):
            loop.run(until_ns=time_ns - 1)
            for logged in batch:
                loop.at(time_ns, DEVICE, lambda one=logged: self._speak(one))  # type: ignore[misc]
            if progress is not None and done % 1000 == 0:
                progress(self.compared, len(self.log.messages))
        last = self.log.messages[-1].time_ns if self.log.messages else 0
        loop.run(until_ns=last)
        for missing in self._expected:
            self._differ(missing, "nothing")
            break
        self.system.stop()

    def _scheduled(self) -> Iterator[tuple[int, list[Logged]]]:
        """What is to be spoken at each instant; who thinks changes with each launch, so one at a time."""
        thinking: set[str] = set()
        batch: list[Logged] = []
        for one in self.log.messages:
            if one.topic == LAUNCH_TOPIC:
                thinking = self._who_thinks(_launch_of(one))
            if batch and one.time_ns != batch[0].time_ns:
                yield batch[0].time_ns, batch
                batch = []
            if one.publisher in thinking:
                self._expected.append(one)
            else:
                batch.append(one)
        if batch:
            yield batch[0].time_ns, batch

    def _who_thinks(self, launch: Launch) -> set[str]:
        return {
            name for name, entry in launch.nodes.items() if not self._stands_in(node_class(entry.kind, "log"))
        }

    def _stands_in(self, kind: type[Node]) -> bool:
        """Whether the log speaks for nodes of this class: they touch the world, or need what was not recorded."""
        return issubclass(kind, Device) or (
            not self.log.images and any(listens_to(kind, one) for one in IMAGES)
        )

    def _speak(self, logged: Logged) -> None:
        if logged.topic == LAUNCH_TOPIC:
            launch = _launch_of(logged)
            thinking = self._who_thinks(launch)
            self.system.launch(launch, leave_out=set(launch.nodes) - thinking)
            self._thinking = thinking
            return
        message = message_type(logged.kind).from_cdr(logged.data)
        self.system.loop.publish(
            logged.topic, message, logged.publisher, from_device=logged.from_device, latched=logged.latched
        )

    def _compare(self, publication: Publication) -> None:
        if publication.from_device or isinstance(publication.message, IMAGES):
            return
        if publication.publisher not in self.system.nodes or self.differences:
            return
        if not self._expected:
            return  # the log ended in the middle of an instant
        logged = self._expected.popleft()
        self.compared += 1
        same = (
            logged.topic == publication.topic
            and logged.time_ns == publication.time_ns
            and logged.data == publication.message.to_cdr()
        )
        if not same:
            self._differ(
                logged, f"{publication.topic} at {publication.time_ns} ns by {publication.publisher}"
            )

    def _differ(self, logged: Logged, replayed: str) -> None:
        text = f"{logged.topic} at {logged.time_ns} ns by {logged.publisher}"
        self.differences.append(Difference(self.compared, text, replayed))


def _launch_of(logged: Logged) -> Launch:
    return Launch.from_json(String.from_cdr(logged.data).data)
