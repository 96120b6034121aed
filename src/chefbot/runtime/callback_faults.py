"""Isolation of exceptions in callbacks: each one aborts its callback only, is counted and reported.

The motion commands of a node that fails repeatedly are dropped, so the limiter's timeout or the board's
watchdog stops the robot. A node that fails repeatedly although no input explains it is restarted, see
`node_restart`. A UserError that a device raises in its own timer or posted action still ends the
run: so a device signals that it cannot continue.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

from chefbot.errors import ChefbotError, UserError
from chefbot.msgs.chefbot_msgs import WheelSpeeds
from chefbot.msgs.diagnostic_msgs import ERROR, OK, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.geometry_msgs import Twist, TwistStamped
from chefbot.msgs.idl.message import Message
from chefbot.msgs.std_msgs import Header
from chefbot.runtime.loop import DEVICE, CallbackStatistics, Loop

MOTION_COMMANDS: tuple[type[Message], ...] = (Twist, TwistStamped, WheelSpeeds)
"""Types of motion commands."""
FAULT_LIMIT = 3
"""Number of faults of a node within FAULT_WINDOW_NS from which its motion commands are dropped."""
FAULT_WINDOW_NS = 1_000_000_000
"""Length of the sliding window in which faults of a node are counted, ns."""
STATUS = "node faults"
"""Name of the status in /diagnostics."""
REPORT_PERIOD_NS = 1_000_000_000
"""Minimum period between two messages on /diagnostics, ns."""
MAX_REASONS = 100
"""Maximum number of sentences that are counted separately; all others are counted by callback."""


class Fault(NamedTuple):
    """An exception of a node's callback."""

    callback: str
    """Name of the callback, such as 'controller <- scan' or 'controller.control'."""
    error: Exception

    @property
    def sentence(self) -> str:
        """Description of the fault for users, at most 300 characters."""
        kind = "" if isinstance(self.error, ChefbotError) else f"{type(self.error).__name__}: "
        return f"{self.callback}: {kind}{self.error}"[:300]


class Faults:
    """Handles and counts the exceptions of a loop's callbacks.

    `on_new` is called in the loop's thread with the first fault of each kind. `publishes`: changed counts are
    published on /diagnostics as a device's message, so that a log holds them; a replay takes them from there.
    """

    on_bug: Callable[[str], None] | None = None
    """Called with the name of a node at each exception that no input explains, so that it can be restarted."""

    def __init__(self, loop: Loop, on_new: Callable[[Fault], None], *, publishes: bool = True) -> None:
        self._loop, self._on_new, self._publishes = loop, on_new, publishes
        self._counts: Counter[str] = Counter()
        self._recent_ns: dict[str, deque[int]] = {}
        self._reported_kinds: set[tuple[str, type[Exception]]] = set()
        self._next_report_ns = loop.now_ns
        self._report_scheduled = False
        self.bug_count = 0
        """Number of faults that invalid input did not cause (see ChefbotError): bugs."""
        loop.faults = self

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of faults by sentence."""
        return self._counts

    def is_silenced(self, node: str) -> bool:
        """Return whether the node has failed at least FAULT_LIMIT times within the last FAULT_WINDOW_NS."""
        recent = self._recent_ns.get(node)
        if recent is None or len(recent) < FAULT_LIMIT:
            return False
        return self._loop.now_ns - recent[0] <= FAULT_WINDOW_NS

    def handle(self, callback: CallbackStatistics, error: Exception) -> None:
        """Count a fault, and report it if it is the first of its kind.

        A device's own UserError ends the run.
        """
        if isinstance(error, UserError) and callback.from_device:
            raise error
        self.bug_count += not isinstance(error, ChefbotError)
        self._recent_ns.setdefault(callback.owner, deque(maxlen=FAULT_LIMIT)).append(self._loop.now_ns)
        self._count(Fault(callback.name, error))
        if self.on_bug is not None and not isinstance(error, ChefbotError):
            self.on_bug(callback.owner)
        if self._publishes and not self._report_scheduled:
            self._report_scheduled = True
            self._loop.schedule(max(self._loop.now_ns + 1, self._next_report_ns), DEVICE, self._report)

    def _count(self, fault: Fault) -> None:
        counted_by_sentence = fault.sentence in self._counts or len(self._counts) < MAX_REASONS
        self._counts[fault.sentence if counted_by_sentence else fault.callback] += 1
        kind = (fault.callback, type(fault.error))
        if kind not in self._reported_kinds:
            self._reported_kinds.add(kind)
            self._on_new(fault)

    def _report(self) -> None:
        self._report_scheduled = False
        self._next_report_ns = self._loop.now_ns + REPORT_PERIOD_NS
        message = DiagnosticArray(Header.of(self._loop.now_ns, ""), (status_of(self._counts),))
        self._loop.publish("diagnostics", message, "faults", from_device=True)


def status_of(counts: Mapping[str, int]) -> DiagnosticStatus:
    """Return the /diagnostics status with the total and the number of faults by sentence."""
    total = sum(counts.values())
    values = tuple(KeyValue(sentence, str(count)) for sentence, count in counts.items())
    main = max(counts, key=lambda sentence: counts[sentence], default="")
    text = f"{total} callbacks of nodes failed{f', mainly {main}' if main else ''}"
    return DiagnosticStatus(ERROR if total else OK, STATUS, text, "", values)


def first_fault_sentence(message: DiagnosticArray) -> str:
    """Return the first fault sentence in a diagnostics message of a launch's process.

    Empty if there is none.
    """
    sentences = [value.key for status in message.status if status.name == STATUS for value in status.values]
    return sentences[0] if sentences else ""
