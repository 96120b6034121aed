"""The latch of the emergency stop: it changes on request only, and survives a restart of its process.

Besides, it is activated when the robot tips over, and held while the motor board is lost, and released when the board
is back. Like any release, this lets nothing resume: the robot drives on a new command only.
"""

from __future__ import annotations

from typing import NamedTuple

from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Header

PRESSED = "Emergency stop was pressed."
RELEASED = "Emergency stop was released."
PRESSED_BY_TOPIC = "Emergency stop was published on emergency_stop by another node."
ESTOP_RESTORED = "Drive base restarted; emergency stop is still active. Release it to drive."
ESTOP_STATE_UNKNOWN = (
    "Drive base restarted with an unknown emergency stop state: emergency stop is active. "
    "Release it to drive."
)

TIPPED_OVER = (
    "The robot has tipped over or is held aslant; set it upright and release the emergency stop to drive."
)
BOARD_LOST = "The motor board does not answer; the robot is stopped."
BOARD_BACK = "The motor board answers again; send the goal again to drive."


class StopDecision(NamedTuple):
    """The status to publish; whether the base must stop at once; a notice for the operator, or an empty string."""

    status: EmergencyStopStatus
    halt: bool
    notice: str = ""


class StopLatch:
    """Owns the state of the emergency stop; every method is an event and returns what to publish, or None.

    Times are in ns of the loop's clock.
    """

    def __init__(self) -> None:
        self.status = EmergencyStopStatus()
        self._lies = False
        """Whether the robot has tipped over and not been set upright since."""

    @property
    def active(self) -> bool:
        """Whether the emergency stop is active."""
        return self.status.active

    def request(self, pressed: bool, now_ns: int) -> StopDecision | None:
        """Press or release the emergency stop; a repeated request has no effect.

        A press while it is held counts; a release does not, nor does one while the robot lies: it would drive off in
        the hands of the person who sets it upright.
        """
        if self.active and not pressed and (self.status.held or self._lies):
            return StopDecision(self.status, False, BOARD_LOST if self.status.held else TIPPED_OVER)
        if pressed == self.active and not self.status.held:
            return None
        return self._set(pressed, PRESSED if pressed else RELEASED, now_ns)

    def confirm(self, pressed: bool, now_ns: int) -> StopDecision | None:
        """Process a published state: another publisher's stop counts, its release is overridden.

        The latch's own messages agree with its state and have no effect.
        """
        if pressed == self.active and not self.status.held:
            return None
        return self._set(True, PRESSED_BY_TOPIC, now_ns) if pressed else StopDecision(self.status, False)

    def tip_over(self, now_ns: int) -> StopDecision | None:
        """Activate the emergency stop because the robot has tipped over, unless it is pressed."""
        self._lies = True
        if self.active and not self.status.held:
            return None
        return self._set(True, TIPPED_OVER, now_ns)._replace(notice=TIPPED_OVER)

    def get_upright(self) -> None:
        """Note that the robot has been set upright; from now on the emergency stop can be released."""
        self._lies = False

    def lose_board(self, now_ns: int) -> StopDecision | None:
        """Hold the robot because the motor board is lost, unless it is stopped already."""
        if self.active:
            return None
        return self._set(True, BOARD_LOST, now_ns, held=True)._replace(notice=BOARD_LOST)

    def regain_board(self, now_ns: int) -> StopDecision | None:
        """Accept commands again, unless the emergency stop was pressed."""
        if not self.status.held:
            return None
        return self._set(False, BOARD_BACK, now_ns)._replace(notice=BOARD_BACK)

    def restore(self, status: EmergencyStopStatus, now_ns: int) -> StopDecision | None:
        """Restore the state from before a restart; a stop that was active stays active since its press.

        A stop since the restart stays active.
        """
        if self.active:
            return None
        self.status = status
        return self._restore_active(ESTOP_RESTORED, now_ns) if status.active else None

    def restore_unknown(self, now_ns: int) -> StopDecision:
        """Activate the emergency stop after a restart that has lost its state."""
        return self._restore_active(ESTOP_STATE_UNKNOWN, now_ns)

    def _restore_active(self, sentence: str, now_ns: int) -> StopDecision:
        return self._set(True, sentence, now_ns)._replace(notice=sentence)

    def _set(self, active: bool, sentence: str, now_ns: int, held: bool = False) -> StopDecision:
        header = Header.of(now_ns, "base_link")
        pressed_at = header.stamp if active and not self.active else self.status.pressed_at
        self.status = EmergencyStopStatus(header, active, held, pressed_at, sentence)
        return StopDecision(self.status, halt=active)
