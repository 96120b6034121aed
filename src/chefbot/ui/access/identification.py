"""Whose a token is: that of the links which the launch printed, or of an invited person."""

from __future__ import annotations

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

        Invitations that cannot be read let nobody in, and are a warning.
        """
        if self._invitations is None:
            return None
        try:
            return self._invitations.visitor(token)
        except StorageError as error:
            self._invitations.warn(str(error))
            return None
