"""A running system: its loop, clock and recorder, made from a launch's arguments."""

from __future__ import annotations

import gc
import sys
import time
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from chefbot.errors import ChefbotError
from chefbot.msgs.diagnostic_msgs import WARN, DiagnosticArray, DiagnosticStatus
from chefbot.msgs.std_msgs import Header, String
from chefbot.robot.spec import Robot
from chefbot.runtime.callback_faults import Fault
from chefbot.runtime.clock import LoopClock, PacedClock, StepClock, WallClock
from chefbot.runtime.launch import Launch
from chefbot.runtime.loop import DEVICE, TIMER, Loop, Publication
from chefbot.runtime.node import Node
from chefbot.runtime.node_container import NodeContainer
from chefbot.runtime.recorder import Recorder

console = Console(highlight=False)
errors = Console(stderr=True, highlight=False, soft_wrap=True)
DIAGNOSTICS_PERIOD_NS = 1_000_000_000
"""Period of the diagnostics after a recording has ended, ns."""
KEEP_ALIVE_PERIOD_NS = 1_000_000_000
"""Period of the timer that keeps a loop without events running, ns."""


def clock_for(kind: str, speed: float) -> LoopClock:
    """Return the clock of a launch; speed 0 means as fast as possible."""
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
    clock: LoopClock | None = None,
    start_ns: int | None = None,
) -> Iterator[NodeContainer]:
    """Yield a system without nodes; stop its nodes and finish the recording in any case.

    `clock`: replaces the one that `kind` and `speed` select. `start_ns`: its start time if not 0 or now.
    """
    # the camera's thread and the loop switch often: the default switch interval of 5 ms is too long
    sys.setswitchinterval(1e-4)
    if start_ns is None:
        start_ns = time.time_ns() if kind == "wall" else 0
    system = NodeContainer(Loop(clock or clock_for(kind, speed), start_ns), robot, seed)
    system.isolate_faults(print_fault)
    ended = RecordingEnd(system.loop)
    recorder = Recorder(record, robot, seed, on_end=ended) if record else None
    if recorder is not None:
        system.loop.add_observer(recorder)
    try:
        yield system
    finally:
        print_fault_counts(system)
        if recorder is not None:
            recorder.close()  # before the nodes stop: their shutdown is not recorded
            ended.print_warning()  # repeated, as the first message may be hours old
        system.stop()


class RecordingEnd:
    """Reports in the terminal and on /diagnostics that the recording ended before the run.

    A robot that carries food does not stop because a log is full.
    """

    def __init__(self, loop: Loop) -> None:
        self._loop, self._sentence = loop, ""

    def __call__(self, why: str) -> None:
        """Report the end of the recording with its reason; called within a publication."""
        self._sentence = (
            f"{why[:1].upper()}{why[1:]}. The recording up to now is complete; the robot continues."
        )
        self.print_warning()
        self._loop.post(self._publish_diagnostics)

    def print_warning(self) -> None:
        """Print a warning in the terminal if the recording has ended early."""
        if self._sentence:
            errors.print(f"Warning: {self._sentence}", markup=False)

    def _publish_diagnostics(self) -> None:
        status = DiagnosticStatus(WARN, "recording", self._sentence)
        message = DiagnosticArray(Header.of(self._loop.now_ns, ""), (status,))
        self._loop.publish("diagnostics", message, "recording", from_device=True)
        self._loop.schedule(self._loop.now_ns + DIAGNOSTICS_PERIOD_NS, DEVICE, self._publish_diagnostics)


def print_fault(fault: Fault) -> None:
    """Print the first fault of each kind; with a traceback if it is a program error."""
    errors.print(f"Fault: {fault.sentence}", markup=False)
    if not isinstance(fault.error, ChefbotError):
        errors.print("".join(traceback.format_exception(fault.error)), markup=False, end="")


def print_fault_counts(system: NodeContainer) -> None:
    """Print the number of faults of each kind at the end of a run."""
    counts = system.faults.counts if system.faults else {}
    for sentence, count in counts.items():
        errors.print(f"Fault, {count} times: {sentence}", markup=False)


def start(system: NodeContainer, launch: Launch) -> None:
    """Replace the nodes within an event of the loop, as all changes are made.

    Exceptions are raised to the caller.
    """
    outcome: list[BaseException | None] = []

    def switch() -> None:
        try:
            system.launch(launch)
        except BaseException as error:
            outcome.append(error)
        else:
            outcome.append(None)

    system.loop.post(switch)
    system.loop.run(until=lambda: bool(outcome))  # no end time: a wall clock may have passed it already
    if not outcome:
        system.loop.stop()  # it was stopped meanwhile, so the next run has to end at once
        return
    if outcome[0] is not None:
        raise outcome[0]
    freeze_loaded_objects()


def freeze_loaded_objects() -> None:
    """Exclude everything that is loaded by now from garbage collection, as it stays until the end.

    A full collection would otherwise go through all of it, and stop the loop for 0.1 s.
    """
    gc.collect()
    gc.freeze()


def keep_loop_alive(loop: Loop) -> None:
    """Keep a loop running that has no events of its own.

    Nodes that only subscribe may still receive messages.
    """
    loop.schedule(loop.now_ns + KEEP_ALIVE_PERIOD_NS, TIMER, lambda: keep_loop_alive(loop))


def announce(console: Console, nodes: Iterable[Node]) -> None:
    """Print what each node announces at its start, such as the address of the web UI."""
    for node in nodes:
        sentence, code = getattr(node, "announcement", ""), getattr(node, "qr_code", "")
        if sentence:
            console.print(f"  {sentence}", markup=False, soft_wrap=True)
        if code:
            console.print(code, style="bright_white on black", markup=False, soft_wrap=True)


def print_notices(publication: Publication) -> None:
    """Print the notices of nodes for the operator in the terminal."""
    if publication.topic.endswith("/notice") and isinstance(publication.message, String):
        console.print(f"  {publication.message.data}", markup=False, soft_wrap=True)
