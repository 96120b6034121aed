"""Whose a token is: that of the links which the launch printed, or of an invited person."""

from __future__ import annotations

from contextlib import suppress

from chefbot.storage.atomic_files import StorageError
from chefbot.ui.access.invitations import Invitations
from chefbot.ui.access.visitors import TokenKey, Visitor


class Identification:
    """Finds the visitor of a token by the launch's `key` and by the robot's `invitations`, if it has any."""

    def __init__(self, key: TokenKey, invitations: Invitations | None = None) -> None:
        self._key, self._invitations = key, invitations

    def visitor(self, token: str) -> Visitor | None:
        """Return the visitor to whom a token was given, or None if it is not valid."""
        return self._key.visitor(token) or self.invited(token)

    def invited(self, token: str) -> Visitor | None:
        """Return the invited person whose token this is; None for other tokens.

        Invitations that cannot be read let nobody in; the launch prints why.
        """
        with suppress(StorageError):
            return self._invitations.visitor(token) if self._invitations else None
        return None
