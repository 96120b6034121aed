"""The emergency stop of the base: its state, its owner, and what restores it after a restart."""

from __future__ import annotations

from abc import abstractmethod

from chefbot.msgs.chefbot_msgs import EmergencyStopStatus
from chefbot.msgs.std_msgs import Bool, Empty, String
from chefbot.nodes.collision_monitor import CollisionMonitorNode
from chefbot.runtime.node import RESTARTED, In, Out, restored, topic
from chefbot.safety.stop_latch import StopDecision, StopLatch


class EmergencyStopNode(CollisionMonitorNode):
    """Owns the state of the emergency stop.

    Others request a change on `stop_request`, and the node publishes the state on `emergency_stop` and the reason on
    `stop_status`, both transient local. A stop published on `emergency_stop` by another node counts; a release
    published there does not.
    """

    stop_request: In[Bool]
    external_stop: In[Bool] = topic("emergency_stop")
    board_connected: In[Bool]
    restored_status: In[EmergencyStopStatus] = restored("stop_status")
    restarted: In[Empty] = restored(RESTARTED)
    emergency_stop: Out[Bool] = topic(latched=True)
    stop_status: Out[EmergencyStopStatus] = topic(latched=True)
    notice: Out[String] = topic("base/notice")

    def start(self) -> None:
        """Publish the state of the emergency stop."""
        super().start()
        self._stop, self._stop_published = StopLatch(), False
        self._own_stops: list[bool] = []
        """Messages on `emergency_stop` of this node that it has not received yet."""
        self.spawn(self._publish_initial_stop())

    @abstractmethod
    def discard_commands(self) -> None:
        """Discard all commands and stop, at once."""

    def forget_own_stops(self) -> None:
        """Forget the own messages; for a timer, as messages come before timers, so that none is on its way then."""
        self._own_stops.clear()

    async def _publish_initial_stop(self) -> None:
        await self.sleep(0.0)  # a state restored after a restart is published first, instead of this one
        if not self._stop_published:
            self._publish_stop(self._stop.status)

    def on_restored_status(self, status: EmergencyStopStatus) -> None:
        """Restore an active emergency stop after a restart."""
        self._apply(self._stop.restore(status, self.now_ns))

    def on_restarted(self, _: Empty) -> None:
        """Activate the emergency stop after a restart if its state could not be restored."""
        if self.restored_status.last is None:
            self._apply(self._stop.restore_unknown(self.now_ns))

    def on_stop_request(self, request: Bool) -> None:
        """Press or release the emergency stop on request; repeated requests have no effect."""
        self._apply(self._stop.request(request.data, self.now_ns))

    def on_external_stop(self, pressed: Bool) -> None:
        """Process `emergency_stop`: this node's own message, which changes nothing, or that of another publisher."""
        if pressed.data in self._own_stops:
            self._own_stops.remove(pressed.data)
        else:
            self._apply(self._stop.confirm(pressed.data, self.now_ns))

    def on_board_connected(self, connected: Bool) -> None:
        """Hold the robot while the motor board is lost; afterwards it drives on a new command."""
        change = self._stop.regain_board if connected.data else self._stop.lose_board
        self._apply(change(self.now_ns))

    def _apply(self, decision: StopDecision | None) -> None:
        """Publish a decision of the latch; earlier commands are discarded and do not resume after the release."""
        if decision is None:
            return
        if decision.halt:
            self.discard_commands()
        self._publish_stop(decision.status)
        self.publish_notice(decision.notice)

    def publish_notice(self, notice: str) -> None:
        """Publish a notice for the operator, unless it is empty."""
        if notice:
            self.notice.publish(String(notice))

    def _publish_stop(self, status: EmergencyStopStatus) -> None:
        self._stop_published = True
        self.stop_status.publish(status)
        self._own_stops.append(status.active)
        self.emergency_stop.publish(Bool(status.active))
