"""The PIN that ends the kiosk view on the robot's own screen."""

from __future__ import annotations

import hmac
import math
from collections import deque

from chefbot.errors import UserError

ATTEMPTS, PERIOD = 5, 60.0
"""Number of wrong PINs in a period, s, after which none is accepted until the first of them is older than that."""


class KioskLock:
    """Checks the PIN; an empty one of the owner lets everybody leave."""

    def __init__(self, pin: str) -> None:
        self._pin = pin
        self._wrong: deque[float] = deque(maxlen=ATTEMPTS)

    def check(self, pin: str, now: float) -> None:
        """Raise UserError if the PIN is wrong, or not accepted after too many wrong ones. now: s, monotonic."""
        if not self._pin:
            return
        if not pin:
            raise UserError("Enter the PIN to leave this view")
        if len(self._wrong) == ATTEMPTS and (wait := self._wrong[0] + PERIOD - now) > 0.0:
            raise UserError(f"Too many wrong PINs; wait {math.ceil(wait)} s")
        if not hmac.compare_digest(pin.encode(), self._pin.encode()):
            self._wrong.append(now)
            raise UserError("The PIN is wrong")
