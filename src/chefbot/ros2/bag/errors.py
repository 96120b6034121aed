"""The exception for bags."""

from __future__ import annotations

from chefbot.errors import ChefbotError


class BagError(ChefbotError):
    """A bag that cannot be read, played or created; the message names the file."""
