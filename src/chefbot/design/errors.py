"""The exception for designs that cannot be made."""

from __future__ import annotations

from chefbot.errors import ChefbotError


class DesignError(ChefbotError):
    """A drawing, model or configuration that cannot be derived from the robot."""
