"""Replay of a log: devices' messages come from the file; nodes are re-executed and their output compared."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

from chefbot.msgs.idl.registry import message_type
from chefbot.msgs.std_msgs import String
from chefbot.runtime.callback_faults import Faults
from chefbot.runtime.clock import StepClock
from chefbot.runtime.launch import Launch, node_class
from chefbot.runtime.loop import DEVICE, Loop, Publication
from chefbot.runtime.node import Device, Node, subscribes_to
from chefbot.runtime.node_container import LAUNCH_TOPIC, NodeContainer
from chefbot.runtime.recorded_log import LoggedMessage, RecordedLog
from chefbot.runtime.recorder import IMAGES


class ReplayMismatch(NamedTuple):
    """The first deviation of a replay from its log."""

    position: int
    """Number of identical messages before it."""
    logged: str
    replayed: str


class Replay:
    """Re-executes the nodes of a log; `differences` is empty if all messages are bit-identical."""

    def __init__(self, log: RecordedLog) -> None:
        self.log = log
        self.compared = 0
        self.differences: list[ReplayMismatch] = []
        start = log.messages[0].time_ns if log.messages else 0
        self._end_ns = log.messages[-1].time_ns if log.messages else 0
        self.system = NodeContainer(Loop(StepClock(), start), log.robot, log.seed)
        self._expected: deque[LoggedMessage] = deque()
        self.faults = Faults(self.system.loop, lambda _: None, publishes=False)
        """Faults of the re-executed nodes; the same as in the recording if nothing differs."""
        self.system.loop.add_observer(self._compare)

    def run(self, progress: Callable[[int, int], None] | None = None) -> None:
        """Run to the end of the log or to its first difference.

        `progress` is called now and then with the number of compared messages and the number of all messages.
        """
        loop = self.system.loop
        for count, (time_ns, batch) in enumerate(self._batches_to_publish()):
            loop.run(until_ns=time_ns - 1)
            for logged in batch:
                loop.schedule(time_ns, DEVICE, partial(self._publish_logged, logged))
            if progress is not None and count % 1000 == 0:
                progress(self.compared, len(self.log.messages))
            if self.differences:
                break
        else:
            loop.run(until_ns=self._end_ns)
        if self._expected and not self.differences:
            self._add_difference(self._expected[0], None)
        self.system.stop()

    def _batches_to_publish(self) -> Iterator[tuple[int, list[LoggedMessage]]]:
        """Yield the messages to publish from the log instant by instant; queue the others for comparison."""
        executed: set[str] = set()
        batch: list[LoggedMessage] = []
        for message in self.log.messages:
            if batch and message.time_ns != batch[0].time_ns:
                yield batch[0].time_ns, batch
                batch = []
            if message.topic == LAUNCH_TOPIC:
                executed = _executed_nodes(_decode_launch(message))
            if message.publisher in executed:
                self._expected.append(message)
            else:
                batch.append(message)
        if batch:
            yield batch[0].time_ns, batch

    def _publish_logged(self, logged: LoggedMessage) -> None:
        if logged.topic == LAUNCH_TOPIC:
            launch = _decode_launch(logged)
            self.system.launch(launch, leave_out=set(launch.nodes) - _executed_nodes(launch))
            return
        message = message_type(logged.kind).from_cdr(logged.data)
        self.system.loop.publish(
            logged.topic, message, logged.publisher, from_device=logged.from_device, latched=logged.latched
        )

    def _compare(self, publication: Publication) -> None:
        if publication.publisher not in self.system.nodes or self.differences:
            return
        if isinstance(publication.message, IMAGES):
            return
        if not self._expected:
            if publication.time_ns < self._end_ns:  # else the log ended in the middle of an instant
                self._add_difference(None, publication)
            return
        logged = self._expected.popleft()
        if _same(logged, publication):
            self.compared += 1
        else:
            self._add_difference(logged, publication)

    def _add_difference(self, logged: LoggedMessage | None, replayed: Publication | None) -> None:
        self.differences.append(ReplayMismatch(self.compared, _describe(logged), _describe(replayed)))


def _executed_nodes(launch: Launch) -> set[str]:
    kinds = {name: node_class(entry.kind, "log") for name, entry in launch.nodes.items()}
    return {name for name, kind in kinds.items() if not _is_played_back(kind)}


def _is_played_back(kind: type[Node]) -> bool:
    """Return whether messages of such nodes come from the log: devices, nodes with unrecorded input."""
    return issubclass(kind, Device) or any(subscribes_to(kind, image_type) for image_type in IMAGES)


def _same(logged: LoggedMessage, publication: Publication) -> bool:
    return (
        logged.topic == publication.topic
        and logged.time_ns == publication.time_ns
        and logged.publisher == publication.publisher
        and logged.data == publication.message.to_cdr()
    )


def _describe(message: LoggedMessage | Publication | None) -> str:
    return "nothing" if message is None else f"{message.topic} at {message.time_ns} ns by {message.publisher}"


def _decode_launch(logged: LoggedMessage) -> Launch:
    return Launch.from_json(String.from_cdr(logged.data).data)
