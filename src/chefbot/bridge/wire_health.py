"""Health of the wire, in diagnostics and on /rosout: rejected and lost messages, mismatched endpoints."""

from __future__ import annotations

from datetime import UTC, datetime

from chefbot.bridge.inbox import Inbox
from chefbot.bridge.membership_health import MembershipHealth
from chefbot.bridge.node_proxies import NodeProxies
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.errors import ErrorCounter
from chefbot.ros2.rmw.graph import Graph

CMD_VEL = "cmd_vel"
"""Topic that the drive base publishes its command on, and does not subscribe to."""
RECENT_NS = 10_000_000_000
"""Time for which a loss is a warning, ns; it stays in the count: a burst at a launch's start is not a lasting
fault."""
MAX_VALUES = 50
"""Maximum number of values in a diagnostic status."""


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
        self._reported_membership: tuple[int, str] = (OK, "")
        self._rosout = proxies.own_rosout
        self._publisher = proxies.own.publisher("diagnostics", DiagnosticArray)
        self._reported: tuple[dict[str, int], list[str]] = ({}, [])
        self._last_loss_ns = -RECENT_NS
        self._was_warning = False
        self._mismatches: list[str] = []
        self._reported_foreign: set[str] = set()

    def check_graph(self) -> None:
        """Find mismatched endpoints after a change of the graph; takes milliseconds."""
        self._mismatches = self._graph.mismatches()
        for name in self._there.foreign_publishers(CMD_VEL):
            sentence = (
                f"{name} publishes on {CMD_VEL}, which the drive base ignores: drive by {CMD_VEL}_teleop"
            )
            self._mismatches.append(sentence)
            if sentence not in self._reported_foreign:
                self._inbox.publish("wire/remark", String(f"Warning: {sentence}."))
        self._reported_foreign.update(self._mismatches)

    def publish(self, now_ns: int) -> None:
        """Publish the diagnostics; changes go into the loop as well, so that they are recorded."""
        counts, mismatches = self._tally.counts(), self._mismatches
        if counts != self._reported[0]:
            self._last_loss_ns = now_ns
        warning = bool(mismatches) or now_ns - self._last_loss_ns < RECENT_NS
        fleet = None if self._membership is None else self._membership.status(datetime.now(UTC))
        statuses = (_status(WARN if warning else OK, counts, mismatches), *([] if fleet is None else [fleet]))
        message = DiagnosticArray(Header.of(now_ns, ""), statuses)
        if self._publisher.has_subscribers:
            self._publisher.publish(message)
        membership = (OK, "") if fleet is None else (fleet.level, fleet.message)
        same = (counts, mismatches) == self._reported and membership == self._reported_membership
        if same and warning == self._was_warning:
            return
        self._log_membership(membership, now_ns)
        self._was_warning = warning
        for reason in [*(reason for reason in counts if reason not in self._reported[0]), *mismatches]:
            if reason not in self._reported[1]:
                self._rosout.log(LOG_WARN, reason, now_ns)
        self._reported = (counts, mismatches)
        self._inbox.publish("diagnostics", message)

    def _log_membership(self, membership: tuple[int, str], now_ns: int) -> None:
        """Log a problem of this machine's membership, a level and a sentence, when it appears."""
        if membership[0] != OK and membership != self._reported_membership:
            self._rosout.log(LOG_WARN, membership[1], now_ns)
        self._reported_membership = membership


def _status(level: int, counts: dict[str, int], mismatches: list[str]) -> DiagnosticStatus:
    values = [KeyValue(reason[:200], str(count)) for reason, count in counts.items()]
    values += [KeyValue("mismatch", sentence[:200]) for sentence in mismatches]
    text = f"{sum(counts.values())} messages rejected or lost, {len(mismatches)} mismatches"
    return DiagnosticStatus(level, "wire", text, "", tuple(values[:MAX_VALUES]))
