"""Causes in the statuses of nodes: recoveries, goals given up, emergency stop, battery, lost processes."""

from __future__ import annotations

import msgspec

from chefbot.causes.reports import DETOUR, EMERGENCY_STOP, END, FAILURE, STOP, make_report, stamped
from chefbot.causes.sentences import after_colon
from chefbot.msgs.chefbot_msgs import (
    BatteryStatus,
    Cause,
    DeliveryStatus,
    EmergencyStopStatus,
    NavigationStatus,
    Quantity,
)
from chefbot.msgs.chefbot_msgs.deliveries import BY_PERSONS

CANCELLED = "The goal was cancelled."
"""Reason of a navigation that somebody ended; it has not failed."""
ENDED_BY_STOP = "The emergency stop ended the goal."
"""Reason of a navigation that the emergency stop ended."""
NO_FAILURE = ("", CANCELLED, ENDED_BY_STOP)
"""Reasons of a navigation that has not failed; the base reports the emergency stop."""


class StatusReports:
    """Turns the statuses of nodes into reports when they change. Each method returns the reports that are due.

    The reports are not periodic, so that an end is due at once.
    """

    def __init__(self) -> None:
        self._open: dict[str, Cause] = {}
        self._navigation = NavigationStatus()
        self._delivery = DeliveryStatus()
        self.exploring = False
        """Whether the explorer chooses the goals: it cancels one whose frontier is mapped before it is reached."""

    def open_checks(self, node: str) -> tuple[str, ...]:
        """Return the check of the report about a node that is open here, if there is one."""
        return (self._open[node].check,) if node in self._open else ()

    def navigation(self, status: NavigationStatus, now_ns: int) -> list[Cause]:
        """Report recoveries, and goals that ended without being reached."""
        before, self._navigation = self._navigation, status
        reports = []
        if before.state != "idle" and status.state == "idle" and status.reason not in NO_FAILURE:
            aborted = make_report(
                FAILURE, "goal aborted", f"The goal was aborted: {after_colon(status.reason)}"
            )
            reports.append(stamped(aborted, "navigator", now_ns))
        if status.state == "waiting":
            return reports  # the controller reports for what it waits
        found = _recovery(status) if status.state == "recovering" else None
        reports += self._change("navigator", found, now_ns)
        ended = before.state != "idle" and status.state == "idle"
        if ended and status.reason == CANCELLED and not self.exploring:
            # a robot without a goal is not held up: it ends at once
            cancelled = stamped(make_report(STOP, "cancelled goal", status.reason), "navigator", now_ns)
            reports += [cancelled, msgspec.structs.replace(cancelled, kind=END)]
        return reports

    def emergency_stop(self, status: EmergencyStopStatus, now_ns: int) -> list[Cause]:
        """Report that the emergency stop is active."""
        text = status.description or "it is active."
        if "emergency stop" not in text.lower():
            text = f"Emergency stop: {after_colon(text)}"
        found = make_report(STOP, EMERGENCY_STOP, text) if status.active else None
        return self._change("base", found, now_ns)

    def battery(self, status: BatteryStatus, now_ns: int) -> list[Cause]:
        """Report that the battery sends the robot home, or lets it park only."""
        kind = {"return": DETOUR, "park": STOP}.get(status.level)
        charge = (Quantity("charge", status.charge, ""),)
        found = make_report(kind, "battery charge", status.description, numbers=charge) if kind else None
        return self._change("battery", found, now_ns)

    def lost_process(self, process: str, now_ns: int) -> list[Cause]:
        """Report that a process does not respond; an empty name ends the report."""
        text = f"The process {process} does not respond; the robot stops until it responds again."
        return self._change("supervisor", make_report(STOP, "heartbeat", text) if process else None, now_ns)

    def delivery(self, status: DeliveryStatus, now_ns: int) -> list[Cause]:
        """Report places that the robot could not serve, and deliveries that failed for another reason."""
        before, self._delivery = self._delivery, status
        new = status.skipped_reasons[len(before.skipped_reasons) :]
        reports = [
            make_report(FAILURE, "place not served", reason)
            for reason in new
            if not reason.endswith(BY_PERSONS)
        ]
        is_known = status.description in status.skipped_reasons  # reported when it happened
        if status.state == "failed" and before.state != "failed" and not is_known:
            reports.append(make_report(FAILURE, "delivery", status.description))
        return [stamped(report, "delivery", now_ns) for report in reports]

    def _change(self, node: str, found: Cause | None, now_ns: int) -> list[Cause]:
        """Return the end of what the node reported before, if it is over, and the report of the present one."""
        before = self._open.get(node)
        if _key(before) == _key(found):
            return []
        reports = []
        if before is not None:
            del self._open[node]
            reports.append(stamped(msgspec.structs.replace(before, kind=END), node, now_ns))
        if found is not None:
            self._open[node] = stamped(found, node, now_ns)
            reports.append(self._open[node])
        return reports


def _recovery(status: NavigationStatus) -> Cause:
    count = Quantity("recoveries", status.recoveries, "")
    text = status.reason
    if status.recoveries:  # relocalization is none
        text = f"Recovery {status.recoveries}: {after_colon(status.reason)}"
    check = "localization" if status.reason.startswith("Localization") else "recovery"
    return make_report(STOP, check, text, numbers=(count,))


def _key(report: Cause | None) -> tuple[str, ...]:
    """Return what distinguishes two reports of one status: a battery's text changes with each percent."""
    if report is None:
        return ()
    return (
        report.kind,
        report.check,
        *(str(number.value) for number in report.numbers if number.name == "recoveries"),
    )
