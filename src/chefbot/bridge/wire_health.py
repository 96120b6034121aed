"""What the wire refused and lost, and who cannot hear whom: in diagnostics and on /rosout."""

from __future__ import annotations

from chefbot.bridge.inbox import Inbox
from chefbot.bridge.node_proxies import Represented
from chefbot.msgs.diagnostic_msgs import OK, WARN, DiagnosticArray, DiagnosticStatus, KeyValue
from chefbot.msgs.rcl_interfaces import WARN as LOG_WARN
from chefbot.msgs.std_msgs import Header, String
from chefbot.ros2.rmw.errors import Tally
from chefbot.ros2.rmw.graph import Graph

COMMANDED = "cmd_vel"
"""What the base publishes there it does not take from there."""
RECENT_NS = 10_000_000_000
"""A loss so long ago is counted on, but warned of no more: a burst when a launch starts is no fault that lasts."""
MOST = 50
"""Kinds of trouble that are told at once."""


class Health:
    """Told by the launch's own node once in PERIOD to those who listen, and in the loop whenever it has changed."""

    PERIOD = 1.0

    def __init__(self, tally: Tally, graph: Graph, there: Represented, inbox: Inbox) -> None:
        self._tally, self._graph, self._there, self._inbox = tally, graph, there, inbox
        self._rosout = there.own_rosout
        self._publisher = there.own.publisher("diagnostics", DiagnosticArray)
        self._told: tuple[dict[str, int], list[str]] = ({}, [])
        self._risen_ns = -RECENT_NS
        self._warned = False
        self._mismatches: list[str] = []
        self._remarked: set[str] = set()

    def look(self) -> None:
        """Somebody came or went: who cannot hear whom now. It costs milliseconds."""
        self._mismatches = self._graph.mismatches()
        for name in self._there.strangers(COMMANDED):
            sentence = (
                f"{name} publishes on {COMMANDED}, which the base does not take: drive by {COMMANDED}_teleop"
            )
            self._mismatches.append(sentence)
            if sentence not in self._remarked:
                self._inbox.say("wire/remark", String(f"Warning: {sentence}."))
        self._remarked.update(self._mismatches)

    def tell(self, now_ns: int) -> None:
        """What is new goes into the loop as well, so that the log has it."""
        counts, mismatches = self._tally.counts(), self._mismatches
        if counts != self._told[0]:
            self._risen_ns = now_ns
        warned = bool(mismatches) or now_ns - self._risen_ns < RECENT_NS
        array = DiagnosticArray(Header.of(now_ns, ""), (_status(WARN if warned else OK, counts, mismatches),))
        if self._publisher.heard:
            self._publisher.publish(array)
        if (counts, mismatches) == self._told and warned == self._warned:
            return
        self._warned = warned
        for reason in [*(one for one in counts if one not in self._told[0]), *mismatches]:
            if reason not in self._told[1]:
                self._rosout.say(LOG_WARN, reason, now_ns)
        self._told = (counts, mismatches)
        self._inbox.say("diagnostics", array)


def _status(level: int, counts: dict[str, int], mismatches: list[str]) -> DiagnosticStatus:
    values = [KeyValue(reason[:200], str(count)) for reason, count in counts.items()]
    values += [KeyValue("mismatch", sentence[:200]) for sentence in mismatches]
    text = f"{sum(counts.values())} messages refused or lost, {len(mismatches)} mismatches"
    return DiagnosticStatus(level, "wire", text, "", tuple(values[:MOST]))
