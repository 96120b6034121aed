"""A running system: loop, clock, recorder, from a launch's arguments."""

from __future__ import annotations

import sys
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from chefbot.errors import UserError
from chefbot.msgs.diagnostic_msgs import WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.clock import Clock, PacedClock, StepClock, WallClock
from chefbot.runtime.launch import Launch
from chefbot.runtime.loop import DEVICE, TIMER, Loop, Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import System
from chefbot.runtime.recorder import Recorder

console = Console(highlight=False)
errors = Console(stderr=True, highlight=False, soft_wrap=True)
TELL_NS = 1_000_000_000
KEEP_GOING_NS = 1_000_000_000


def clock_for(kind: str, speed: float) -> Clock:
    """The clock of a launch; speed 0 is as fast as may be."""
    if kind == "wall":
        return WallClock()
    return PacedClock(speed) if speed > 0 else StepClock()


@contextmanager
def session(
    robot: Robot,
    seed: int,
    kind: str,
    speed: float,
    record: Path | None,
    clock: Clock | None = None,
    start_ns: int | None = None,
) -> Iterator[System]:
    """A system without nodes yet; stops its nodes and finishes the recording whatever happens.

    `clock`: another than that for `kind` and `speed`. `start_ns`: where its time begins if not at 0 or now.
    """
    # the camera's thread and the loop hand the interpreter to each other often; 5 ms each time is too long
    sys.setswitchinterval(1e-4)
    if start_ns is None:
        start_ns = time.time_ns() if kind == "wall" else 0
    system = System(Loop(clock or clock_for(kind, speed), start_ns), robot, seed)
    system.isolate(show_fault)
    ended = RecordingEnd(system.loop)
    recorder = Recorder(record, robot, seed, on_end=ended) if record else None
    if recorder is not None:
        system.loop.tap(recorder)
    try:
        yield system
    finally:
        show_faults(system)
        if recorder is not None:
            recorder.close()  # before the nodes end: how they end is no part of what they did
            ended.say()  # what was said hours ago may have scrolled away
        system.stop()


class RecordingEnd:
    """Tells people that a recording ended before its robot did: the terminal, and all who hear /diagnostics.

    A robot that carries food does not stop because a log is full.
    """

    def __init__(self, loop: Loop) -> None:
        self._loop, self._sentence = loop, ""

    def __call__(self, why: str) -> None:
        """In the loop's thread, while something is published."""
        self._sentence = f"{why[:1].upper()}{why[1:]}. What was recorded before is whole; the robot goes on."
        self.say()
        self._loop.post(self._tell)

    def say(self) -> None:
        """In the terminal, if there is something to say."""
        if self._sentence:
            errors.print(f"Warning: {self._sentence}", markup=False)

    def _tell(self) -> None:
        status = DiagnosticStatus(WARN, "recording", self._sentence)
        message = DiagnosticArray(Header.of(self._loop.now_ns, ""), (status,))
        self._loop.publish("diagnostics", message, "recording", from_device=True)
        self._loop.at(self._loop.now_ns + TELL_NS, DEVICE, self._tell)


def show_fault(fault: Fault) -> None:
    """In the terminal, the first of each kind; where the program is at fault with its traceback."""
    errors.print(f"Fault: {fault.sentence}", markup=False)
    if not isinstance(fault.error, UserError):
        errors.print("".join(traceback.format_exception(fault.error)), markup=False, end="")


def show_faults(system: System) -> None:
    """At the end: how many there were of each kind."""
    counts = system.faults.counts if system.faults else {}
    for sentence, count in counts.items():
        errors.print(f"Fault, {count} times: {sentence}", markup=False)


def start(system: System, launch: Launch) -> None:
    """Replace the nodes, as an event of the loop like everything else; faults are raised here."""
    outcome: list[BaseException | None] = []

    def switch() -> None:
        try:
            system.launch(launch)
        except BaseException as fault:
            outcome.append(fault)
        else:
            outcome.append(None)

    system.loop.post(switch)
    system.loop.run(until=lambda: bool(outcome))  # not until a time: a wall clock may have passed it already
    if outcome[0] is not None:
        raise outcome[0]


def keep_going(loop: Loop) -> None:
    """A loop without events ends; nodes that only listen have none of their own, and others may speak to them."""
    loop.at(loop.now_ns + KEEP_GOING_NS, TIMER, lambda: keep_going(loop))


def announce(console: Console, nodes: Iterable[Node]) -> None:
    """What each has to say when it starts, such as where its page is."""
    for node in nodes:
        sentence, code = getattr(node, "announcement", ""), getattr(node, "qr_code", "")
        if sentence:
            console.print(f"  {sentence}", markup=False, soft_wrap=True)
        if code:
            console.print(code, style="bright_white on black", markup=False, soft_wrap=True)


def show_remarks(publication: Publication) -> None:
    """What nodes have to say to the person who started them."""
    if publication.topic.endswith("/remark") and isinstance(publication.message, String):
        console.print(f"  {publication.message.data}", markup=False, soft_wrap=True)
