"""Health of the wire, in diagnostics and on /rosout: rejected and lost messages, mismatched endpoints."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime

from chefbot.bridge.inbox import Inbox
from chefbot.bridge.membership_health import MembershipHealth
from chefbot.bridge.node_proxies import NodeProxies
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.errors import QUEUE_FULL, ErrorCounter
from chefbot.ros2.rmw.graph import Graph

CMD_VEL = "cmd_vel"
"""Topic that the drive base publishes its command on, and does not subscribe to."""
RECENT_NS = 10_000_000_000
"""Time for which a loss is a warning, ns; it stays in the count: a burst at a launch's start is not a lasting
fault."""
MAX_VALUES = 50
"""Maximum number of values in a diagnostic status."""
SHOWN_PARTS = 2
"""Number of problems, and of topics, that the message names; the values name all."""


class WireHealth:
    """Publishes the wire's diagnostics: messages that were rejected or lost, and mismatched endpoints.

    Every PERIOD seconds if there is a subscriber; in the loop whenever they change.
    """

    PERIOD = 1.0

    def __init__(
        self,
        tally: ErrorCounter,
        graph: Graph,
        proxies: NodeProxies,
        inbox: Inbox,
        membership: MembershipHealth | None = None,
    ) -> None:
        self._tally, self._graph, self._there, self._inbox = tally, graph, proxies, inbox
        self._membership = membership
        self._name = proxies.own.full_name
        self._reported_membership: tuple[int, str] = (OK, "")
        self._rosout = proxies.own_rosout
        self._publisher = proxies.own.publisher("diagnostics", DiagnosticArray)
        self._reported: tuple[dict[str, int], list[str]] = ({}, [])
        self._last_increase_ns: dict[str, int] = {}
        self._reported_losses: list[str] = []
        self._mismatches: list[str] = []
        self._reported_foreign: set[str] = set()
        self._noticed_topics: set[str] = set()

    def check_graph(self) -> None:
        """Find mismatched endpoints after a change of the graph; takes milliseconds."""
        self._mismatches = self._graph.mismatches()
        for name in self._there.foreign_publishers(CMD_VEL):
            sentence = (
                f"{name} publishes on {CMD_VEL}, which the drive base ignores: drive by {CMD_VEL}_teleop"
            )
            self._mismatches.append(sentence)
            if sentence not in self._reported_foreign:
                self._inbox.publish("wire/notice", String(f"Warning: {sentence}."))
        self._reported_foreign.update(self._mismatches)

    def publish(self, now_ns: int) -> None:
        """Publish the diagnostics; changes go into the loop as well, so that they are recorded."""
        counts, mismatches = self._tally.counts(), self._mismatches
        losses = self._recent_losses(counts, now_ns)
        fleet = None if self._membership is None else self._membership.status(datetime.now(UTC))
        wire = _status(self._name, counts, losses, mismatches)
        message = DiagnosticArray(Header.of(now_ns, ""), (wire,) if fleet is None else (wire, fleet))
        if self._publisher.has_subscribers:
            self._publisher.publish(message)
        membership = (OK, "") if fleet is None else (fleet.level, fleet.message)
        same = (counts, mismatches) == self._reported and membership == self._reported_membership
        if same and losses == self._reported_losses:
            return
        self._log_membership(membership, now_ns)
        self._reported_losses = losses
        self._log_new_reasons(counts, mismatches, now_ns)
        self._notice(reason for reason in counts if not reason.endswith(QUEUE_FULL))
        self._reported = (counts, mismatches)
        self._inbox.publish("diagnostics", message)

    def _log_new_reasons(self, counts: dict[str, int], mismatches: list[str], now_ns: int) -> None:
        for reason in [*(reason for reason in counts if reason not in self._reported[0]), *mismatches]:
            if reason not in self._reported[1]:
                self._rosout.log(LOG_WARN, reason, now_ns)

    def _notice(self, rejections: Iterable[str]) -> None:
        """Publish the first rejection of each topic in the loop, for who looks at the launch's output only."""
        for reason in rejections:
            topic = reason.partition(":")[0]
            if topic not in self._noticed_topics and len(self._reported) < MAX_VALUES:
                self._noticed_topics.add(topic)
                self._inbox.publish("wire/notice", String(f"Warning: message rejected: {reason}."))

    def _recent_losses(self, counts: dict[str, int], now_ns: int) -> list[str]:
        """Return the reasons whose counts have increased within RECENT_NS."""
        for reason, count in counts.items():
            if count != self._reported[0].get(reason):
                self._last_increase_ns[reason] = now_ns
        return [reason for reason in counts if now_ns - self._last_increase_ns[reason] < RECENT_NS]

    def _log_membership(self, membership: tuple[int, str], now_ns: int) -> None:
        """Log a problem of this machine's membership, a level and a sentence, when it appears."""
        if membership[0] != OK and membership != self._reported_membership:
            self._rosout.log(LOG_WARN, membership[1], now_ns)
        self._reported_membership = membership


def _status(name: str, counts: dict[str, int], losses: list[str], mismatches: list[str]) -> DiagnosticStatus:
    """Return the status: what is wrong now is its message, all counts since the start are its values."""
    values = [KeyValue(reason[:200], str(count)) for reason, count in counts.items()]
    values += [KeyValue("mismatch", sentence[:200]) for sentence in mismatches]
    problems = [sentence[:200] for sentence in (*mismatches, *_sentences(losses))]
    text = "; ".join(_first(problems))
    total = f"{sum(counts.values())} messages were rejected or lost since the start"
    return DiagnosticStatus(WARN if problems else OK, "wire", text or total, name, tuple(values[:MAX_VALUES]))


def _sentences(losses: list[str]) -> list[str]:
    """Return the losses as sentences; those by full queues, which occur together, as one."""
    full = [reason.partition(":")[0] for reason in losses if reason.endswith(QUEUE_FULL)]
    others = [reason for reason in losses if not reason.endswith(QUEUE_FULL)]
    if not full:
        return others
    topics = sorted(set(full))
    more = f" and {len(topics) - SHOWN_PARTS} more" if len(topics) > SHOWN_PARTS else ""
    shown = ", ".join(topics[:SHOWN_PARTS])
    return [f"this computer is too slow, messages are lost on {shown}{more}", *others]


def _first(parts: list[str]) -> list[str]:
    more = len(parts) - SHOWN_PARTS
    return [*parts[:SHOWN_PARTS], f"and {more} more"] if more > 0 else parts
