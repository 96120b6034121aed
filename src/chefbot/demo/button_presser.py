"""The people of a simulated delivery, who press the robot's buttons."""

from __future__ import annotations

from chefbot.msgs.chefbot_msgs import DeliveryStatus
from chefbot.msgs.std_msgs import Empty
from chefbot.runtime.loop import DEVICE, Loop, Publication

SECOND = 1_000_000_000
"""One second in nanoseconds."""
PRESSES = {
    "loading": ("loaded", 3 * SECOND),
    "waiting": ("taken", 5 * SECOND),
    "unloading": ("taken", 5 * SECOND),
}
"""Button that a person presses in a state, and its delay after the robot's arrival, ns of the robot's time."""


class ButtonPresser:
    """Observes a loop and presses `loaded` in the kitchen and `taken` at a table, if the robot still waits."""

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self._status = DeliveryStatus()

    def __call__(self, publication: Publication) -> None:
        """Schedule the press of the button that the robot begins to wait for."""
        status = publication.message
        if not isinstance(status, DeliveryStatus):
            return
        self._status = status
        if status.state in PRESSES:
            button, after = PRESSES[status.state]
            self._loop.schedule(self._loop.now_ns + after, DEVICE, lambda: self._press(button, status.place))

    def _press(self, button: str, place: str) -> None:
        status = self._status
        if status.place == place and PRESSES.get(status.state, ("", 0))[0] == button:
            self._loop.publish(button, Empty(), "person", from_device=True)
