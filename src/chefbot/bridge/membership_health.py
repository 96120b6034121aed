"""Diagnostics of this machine's membership in a fleet: its certificate's expiry, removal, and the clock."""

from __future__ import annotations

from datetime import datetime

from chefbot.fleet.keyring import Keyring
from chefbot.fleet.membership_watch import MembershipWatch
from chefbot.msgs.diagnostic_msgs import ERROR, OK, WARN, DiagnosticStatus
from chefbot.ros2.rmw.errors import ErrorCounter


class MembershipHealth:
    """The diagnostic status `fleet`: a warning 30 days before the certificate expires, an error afterwards."""

    def __init__(self, ring: Keyring) -> None:
        """Read the identity from the key folder. Raises UserError if it is invalid."""
        self._watch = MembershipWatch(ring)

    def status(self, now: datetime) -> DiagnosticStatus:
        """Return the status at the time `now`; keys that were renewed meanwhile are read again."""
        self._watch.refresh(ErrorCounter())  # the secured router reports what cannot be read
        if problem := self._watch.problem(now):
            return DiagnosticStatus(ERROR, "fleet", problem, "", ())
        if advice := self._watch.advice(now):
            return DiagnosticStatus(WARN, "fleet", advice, "", ())
        return DiagnosticStatus(OK, "fleet", self._watch.summary(), "", ())
