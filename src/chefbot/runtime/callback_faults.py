"""Exceptions of nodes that run: each costs its callback, is counted and reported, and the loop goes on.

A node that drives and keeps on failing is silenced: its commands stop, so the limiter's time-out or the board's
watchdog lets the robot stand. What a device raises as a UserError of its own accord still ends the run: so a device
says that it cannot go on.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

from chefbot.errors import UserError
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.geometry_msgs import Twist, TwistStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.loop import DEVICE, Loop, Timing
from chefbot.runtime.transform_buffer import TransformError

DRIVES: tuple[type[Message], ...] = (Twist, TwistStamped, WheelSpeeds)
"""Messages that make the wheels turn."""
REPEATED = 3
"""So many faults of a node ..."""
WINDOW_NS = 1_000_000_000
"""... within this time silence what it commands, until no more than REPEATED - 1 lie within it."""
STATUS = "node faults"
"""Name of the status in /diagnostics."""
REPORT_NS = 1_000_000_000
"""/diagnostics is published at most so often."""
OF_INPUT = (UserError, TransformError)
"""These say that what came in is wrong, such as a frame that nobody has published, and not the program."""
MOST_REASONS = 100
"""Kinds of faults that are told apart; all others count under their callback alone."""


class Fault(NamedTuple):
    """An exception of a node's callback, for the first of its kind."""

    callback: str
    """Such as 'controller <- scan' or 'controller.control'."""
    error: Exception

    @property
    def sentence(self) -> str:
        """For people."""
        kind = "" if isinstance(self.error, OF_INPUT) else f"{type(self.error).__name__}: "
        return f"{self.callback}: {kind}{self.error}"[:300]


class Faults:
    """Takes the faults of a loop. `on_new` is given the first of each kind, in the loop's thread.

    `publishes`: the counts go out on /diagnostics whenever they have changed, as a device's message, so that a log
    holds them; a replay has them from there.
    """

    def __init__(self, loop: Loop, on_new: Callable[[Fault], None], *, publishes: bool = True) -> None:
        self._loop, self._on_new, self._publishes = loop, on_new, publishes
        self._counts: Counter[str] = Counter()
        self._recent: dict[str, deque[int]] = {}
        self._kinds: set[tuple[str, type[Exception]]] = set()
        self._next_report_ns = loop.now_ns
        self._report_is_due = False
        self.unexpected = 0
        """Those that are not OF_INPUT: faults of the program."""
        loop.faults = self

    @property
    def counts(self) -> Mapping[str, int]:
        """How often each sentence."""
        return self._counts

    def is_silenced(self, node: str) -> bool:
        """Whether the node has failed REPEATED times within the last second."""
        recent = self._recent.get(node)
        if recent is None or len(recent) < REPEATED:
            return False
        return self._loop.now_ns - recent[0] <= WINDOW_NS

    def take(self, callback: Timing, error: Exception) -> None:
        """Count it, and report it if it is the first of its kind; a device's own UserError ends the run."""
        if isinstance(error, UserError) and callback.from_device:
            raise error
        self.unexpected += not isinstance(error, OF_INPUT)
        self._recent.setdefault(callback.owner, deque(maxlen=REPEATED)).append(self._loop.now_ns)
        self._count(Fault(callback.name, error))
        if self._publishes and not self._report_is_due:
            self._report_is_due = True
            self._loop.at(max(self._loop.now_ns + 1, self._next_report_ns), DEVICE, self._report)

    def _count(self, fault: Fault) -> None:
        known = fault.sentence in self._counts or len(self._counts) < MOST_REASONS
        self._counts[fault.sentence if known else fault.callback] += 1
        kind = (fault.callback, type(fault.error))
        if kind not in self._kinds:
            self._kinds.add(kind)
            self._on_new(fault)

    def _report(self) -> None:
        self._report_is_due = False
        self._next_report_ns = self._loop.now_ns + REPORT_NS
        message = DiagnosticArray(Header.of(self._loop.now_ns, ""), (status_of(self._counts),))
        self._loop.publish("diagnostics", message, "faults", from_device=True)


def status_of(counts: Mapping[str, int]) -> DiagnosticStatus:
    """For /diagnostics: the sum, and how often each."""
    total = sum(counts.values())
    values = tuple(KeyValue(sentence, str(count)) for sentence, count in counts.items())
    return DiagnosticStatus(ERROR if total else OK, STATUS, f"{total} callbacks of nodes failed", "", values)


def first_fault(message: DiagnosticArray) -> str:
    """The first sentence that a process of a launch reports of its nodes' faults; empty if none."""
    sentences = [value.key for one in message.status if one.name == STATUS for value in one.values]
    return sentences[0] if sentences else ""
