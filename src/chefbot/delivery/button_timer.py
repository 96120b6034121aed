"""The timer that replaces the buttons "Loaded" and "Taken", if the owner sets one."""

from __future__ import annotations

from typing import NamedTuple

from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.params import DeliveryParams


class ButtonPress(NamedTuple):
    """A press that is due after `seconds`, for the state and the drive in which it was started."""

    seconds: float
    state: str
    number: int


class ButtonTimer:
    """Knows the press that is pending; it restarts when the robot returns to the place."""

    def __init__(self) -> None:
        self._pending: ButtonPress | None = None

    def update(self, mission: DeliveryRound, params: DeliveryParams) -> ButtonPress | None:
        """Return the press to start waiting for now, or None if nothing has changed or no press is pending."""
        pickup = params.pickup_timeout
        times = {"loading": params.loading_timeout, "waiting": pickup, "unloading": pickup}
        seconds = 0.0 if mission.status.hold_reason else times.get(mission.status.state, 0.0)
        press = ButtonPress(seconds, mission.status.state, mission.number) if seconds else None
        if (press and press[1:]) == (self._pending and self._pending[1:]):
            return None
        self._pending = press
        return press

    def elapse(self, press: ButtonPress, mission: DeliveryRound) -> bool:
        """Press the button after its time; return False, and do nothing, if the press is no longer pending."""
        if self._pending is None or self._pending[1:] != press[1:]:
            return False
        if press.state == "loading":
            mission.loaded()
        else:
            mission.taken()
        return True
