"""This machine's membership while a program runs: renewed keys and new lists are taken over from the key folder."""

from __future__ import annotations

from datetime import datetime

from chefbot.errors import ChefbotError, UserError
from chefbot.fleet.identity import Identity, advice, check_validity
from chefbot.fleet.keyring import Keyring
from chefbot.ros2.rmw.errors import ErrorCounter


class MembershipWatch:
    """The identity of a key folder, read again after `chefbot fleet accept` and `renew` have changed it."""

    def __init__(self, ring: Keyring) -> None:
        """Read the identity. Raises UserError if a file is missing or invalid."""
        self._ring = ring
        self._versions = ring.file_versions()
        self.identity: Identity = ring.identity()

    def refresh(self, errors: ErrorCounter) -> bool:
        """Read changed files; return whether they changed. Of invalid ones the reason is added to `errors`.

        The list is taken over also if it does not contain this machine: those that it removes are refused.
        """
        versions = self._ring.file_versions()
        if versions == self._versions:
            return False
        self._versions = versions
        try:
            self.identity = self._ring.identity()
        except ChefbotError as error:
            errors.add(f"keys changed and cannot be used, the old ones stay in use: {error}")
            return False
        return True

    def problem(self, now: datetime) -> str:
        """Return why other machines refuse this one, or an empty string."""
        try:
            check_validity(self.identity, now)
        except UserError as error:
            return str(error)
        return ""

    def advice(self, now: datetime) -> str:
        """Return what the owner of a valid certificate should do soon, or an empty string."""
        return advice(self.identity, now)

    def summary(self) -> str:
        """Return name, role, list and expiry in one line."""
        me = self.identity
        return (
            f"{me.name}, {me.role or 'no longer a member'} of fleet {me.fleet.name}, list {me.fleet.number}, "
            f"certificate valid until {me.expires:%Y-%m-%d}"
        )
