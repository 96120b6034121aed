"""The exception for the content of messages; errors of their bytes are in `cdr`."""

from __future__ import annotations

from chefbot.errors import ChefbotError


class InvalidMessageError(ChefbotError):
    """A message that breaks a rule of its type; the text names the field and the fault."""
