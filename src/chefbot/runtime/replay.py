"""Replay of a log: its devices speak from the file, its nodes think again, and what they say is compared."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
from mcap.exceptions import McapError
from mcap.reader import make_reader

from chefbot.errors import UserError
from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.std_msgs import String
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Faults
from chefbot.runtime.clock import Clock, StepClock
from chefbot.runtime.launch import Launch, node_class
from chefbot.runtime.loop import DEVICE, Loop, Publication
from chefbot.runtime.node import Device, Node, listens_to
from chefbot.runtime.node_container import LAUNCH_TOPIC, System
from chefbot.runtime.recorder import IMAGES, METADATA

DAMAGE = (
    McapError, struct.error, ValueError, EOFError, KeyError, IndexError, MemoryError, OverflowError,
)  # fmt: skip
"""What reading raises where a file ends too early or holds something else."""


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

    position: int
    """Messages that were the same before."""
    logged: str
    replayed: str


def read_log(path: Path) -> Log:
    """A log as `Recorder` writes it. UserError when it is missing, damaged, or somebody else's."""
    try:
        with path.open("rb") as file:
            return _read(path, file)
    except OSError as error:
        raise UserError(f"log {path} cannot be read: {error.strerror}") from None
    except DAMAGE as error:
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
        self._end_ns = log.messages[-1].time_ns if log.messages else 0
        self.system = System(Loop(clock or StepClock(), start), log.robot, log.seed)
        self._expected: deque[Logged] = deque()
        self.faults = Faults(self.system.loop, lambda _: None, publishes=False)
        """The same as when it was recorded, if nothing differs."""
        self.system.loop.tap(self._compare)

    def run(self, progress: Callable[[int, int], None] | None = None) -> None:
        """To the end of the log, or its first difference; `progress(messages done, all)` now and then."""
        loop = self.system.loop
        for count, (time_ns, batch) in enumerate(self._spoken()):
            loop.run(until_ns=time_ns - 1)
            for logged in batch:
                loop.at(time_ns, DEVICE, partial(self._speak, logged))
            if progress is not None and count % 1000 == 0:
                progress(self.compared, len(self.log.messages))
            if self.differences:
                break
        else:
            loop.run(until_ns=self._end_ns)
        if self._expected and not self.differences:
            self._differ(self._expected[0], None)
        self.system.stop()

    def _spoken(self) -> Iterator[tuple[int, list[Logged]]]:
        """What the log says for devices, instant by instant; what nodes said is put by for comparing."""
        thinking: set[str] = set()
        batch: list[Logged] = []
        for one in self.log.messages:
            if batch and one.time_ns != batch[0].time_ns:
                yield batch[0].time_ns, batch
                batch = []
            if one.topic == LAUNCH_TOPIC:
                thinking = self._who_thinks(_launch_of(one))
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
        """Whether the log speaks for such nodes: they touch the world, or need what was not recorded."""
        return issubclass(kind, Device) or (
            not self.log.images and any(listens_to(kind, one) for one in IMAGES)
        )

    def _speak(self, logged: Logged) -> None:
        if logged.topic == LAUNCH_TOPIC:
            launch = _launch_of(logged)
            self.system.launch(launch, leave_out=set(launch.nodes) - self._who_thinks(launch))
            return
        message = message_type(logged.kind).from_cdr(logged.data)
        self.system.loop.publish(
            logged.topic, message, logged.publisher, from_device=logged.from_device, latched=logged.latched
        )

    def _compare(self, publication: Publication) -> None:
        if publication.publisher not in self.system.nodes or self.differences:
            return
        if isinstance(publication.message, IMAGES) and not self.log.images:
            return
        if not self._expected:
            if publication.time_ns < self._end_ns:  # else the log ended in the middle of an instant
                self._differ(None, publication)
            return
        logged = self._expected.popleft()
        if _same(logged, publication):
            self.compared += 1
        else:
            self._differ(logged, publication)

    def _differ(self, logged: Logged | None, replayed: Publication | None) -> None:
        self.differences.append(Difference(self.compared, _describe(logged), _describe(replayed)))


def _same(logged: Logged, publication: Publication) -> bool:
    return (
        logged.topic == publication.topic
        and logged.time_ns == publication.time_ns
        and logged.publisher == publication.publisher
        and logged.data == publication.message.to_cdr()
    )


def _describe(one: Logged | Publication | None) -> str:
    return "nothing" if one is None else f"{one.topic} at {one.time_ns} ns by {one.publisher}"


def _launch_of(logged: Logged) -> Launch:
    return Launch.from_json(String.from_cdr(logged.data).data)
