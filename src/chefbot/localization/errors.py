"""The exception of localization."""

from __future__ import annotations

from chefbot.errors import ChefbotError


class LocalizationError(ChefbotError):
    """A map, a start pose or a parameter with which a robot cannot be localized."""
