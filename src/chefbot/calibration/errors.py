"""The exception of the calibration."""

from __future__ import annotations

from chefbot.errors import ChefbotError


class CalibrationError(ChefbotError):
    """A calibration drive whose data do not determine the parameters; the message names what to repeat."""
